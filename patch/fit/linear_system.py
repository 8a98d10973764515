"""The least-squares problem of the coefficients, and its maximum-a-posteriori solution."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.fit.smoothness import NormalEquations


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """m weighted least-squares problems: coefficients (t,) @ phi = heights.

    Parameters
    ----------
    phi : (m, t, n) float
        Monomials at the samples.
    heights : (m, n) float, scaled
    weight : (m, n) float
    """

    phi: np.ndarray
    heights: np.ndarray
    weight: np.ndarray

    def __getitem__(self, rows) -> "LinearSystem":
        """Some of the problems."""
        return LinearSystem(self.phi[rows], self.heights[rows], self.weight[rows])

    def equations(self) -> NormalEquations:
        """Normal equations (m, ...)."""
        weighted = self.phi * self.weight[:, None]
        return NormalEquations(
            weighted @ self.phi.transpose(0, 2, 1),
            (weighted @ self.heights[..., None])[..., 0],
            np.einsum("mn,mn,mn->m", self.weight, self.heights, self.heights),
            np.count_nonzero(self.weight, axis=1).astype(float),
        )

    def residuals(self, mean) -> np.ndarray:
        """(m, n) heights less those of coefficients (m, t)."""
        return self.heights - (mean[:, None] @ self.phi)[:, 0]


def map_coefficients(equations: NormalEquations, noise, precision):
    """Maximum-a-posteriori coefficients (m, t) for noise (m,) and prior precision (m, t)."""
    matrix = equations.gram.copy()
    diagonal = np.einsum("...ii->...i", matrix)
    diagonal += precision * (noise * noise)[:, None]
    return np.linalg.solve(matrix, equations.rhs[..., None])[..., 0]
