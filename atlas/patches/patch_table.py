"""Table: one growing numpy array for each property of the patches, a row a patch."""

import numpy as np

from touchatlas.atlas.patches.ball_index import BallIndex
from touchatlas.atlas.patches.monomial_products import products
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.smoothness import NormalEquations, scaled_noise
from touchatlas.patch.geometry.patch import OUTLINE_COUNT, outlines
from touchatlas.patch.geometry.polynomial import GRADIENT, Basis, evaluate_batch, monomials

# Rows that there is room for at first; later an eighth more at a time.
_ROOM = 64

# An outline is laid anew where it stays within this share of the squared core radius.
_OWN = 1.05


class PatchTable:
    """Columns over all patches of an atlas, so that many are handled in one numpy call.

    Parameters
    ----------
    basis : Basis
        Of every patch's polynomial.
    core : float
        Share of a patch's radius that it claims to cover.

    Attributes
    ----------
    index : BallIndex
        The balls of the patch radii about the patch origins.
    rough : dict
        Of rows: what is known of patches that have a residual (``rough.PatchResidual``).
    lengths : (3,) float
        How many patches there are, and the sums of their log feature lengths and of the squares.
    products : Products
        Of the basis: columns ``moments`` and ``variance`` are over these.
    """

    def __init__(self, basis: Basis, core: float) -> None:
        self.basis = basis
        self.core = core
        self.size = 0
        self.index = BallIndex()
        self.residuals: dict = {}
        self.lengths = np.zeros(3)
        self.products = products(basis)
        t, p = basis.size, len(self.products.starts)
        shapes = {
            "alive": (),
            "site": (3,),
            "origin": (3,),
            "axes": (3, 3),
            "radius": (),
            "weight": (),
            "noise": (),
            "measurement_std": (),
            "length_ratio": (),
            "z_scale": (),
            "condition": (),
            "moments": (p,),
            "rhs": (t,),
            "sum_of_squares": (),
            "count": (),
            "learned": (),
            "linearisation_point": (t,),
            "mean": (t,),
            "variance": (p,),
            "residual": (),
            "outline": (OUTLINE_COUNT, 3),
            "outline_open": (OUTLINE_COUNT,),
        }
        kinds = {"alive": bool, "outline_open": bool}
        self._columns = {
            name: np.zeros((_ROOM, *shape), kinds.get(name, float))
            for name, shape in shapes.items()
        }

    def __getattr__(self, name: str) -> np.ndarray:
        columns = self.__dict__.get("_columns", {})
        if name not in columns:
            raise AttributeError(name)
        return columns[name][: self.size]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self._columns)

    def append(self, fit: PatchFit) -> int:
        """Add one fitted patch; returns its row."""
        patch, row = fit.patch, self.size
        if row == len(self._columns["radius"]):
            for name, column in self._columns.items():
                more = np.zeros((max(row // 8, _ROOM), *column.shape[1:]), column.dtype)
                self._columns[name] = np.concatenate([column, more])
        self.size += 1
        self.site[row] = patch.frame.origin
        self.alive[row] = self.outline_open[row] = True
        self.weight[row] = (self.core * patch.radius) ** 2
        self.condition[row] = patch.condition
        self.index.insert(row, patch.frame.origin, patch.radius)
        self._fill(row, fit)
        return row

    def renew(self, row: int, fit: PatchFit) -> None:
        """Put a patch that was fitted anew in the place of a row's; its equations are empty."""
        self._count_length(row, -1.0)
        self.index.move(row, fit.patch.frame.origin, fit.patch.radius)
        self._fill(row, fit)

    def _fill(self, row: int, fit: PatchFit) -> None:
        """Write the numbers of a fit, with no equations, into a row."""
        patch = fit.patch
        values = {
            "origin": patch.frame.origin,
            "axes": patch.frame.axes,
            "radius": patch.radius,
            "noise": patch.noise_std,
            "length_ratio": fit.length_ratio,
            "z_scale": fit.z_scale,
            "moments": 0.0,
            "rhs": 0.0,
            "sum_of_squares": 0.0,
            "count": 0.0,
            "linearisation_point": patch.polynomial.coefficients,
            "mean": patch.polynomial.coefficients,
            "variance": self.products.quadratic_forms(patch.covariance),
            "residual": patch.residual_rms,
        }
        for name, value in values.items():
            self._columns[name][row] = value
        self._count_length(row, 1.0)

    def copy_of(self, row: int) -> dict[str, np.ndarray]:
        """The numbers of a row, for ``put_back``."""
        return {name: column[row].copy() for name, column in self._columns.items()}

    def put_back(self, row: int, values: dict[str, np.ndarray]) -> None:
        """Give a row the numbers that it had."""
        self._count_length(row, -1.0)
        self.index.move(row, values["origin"], float(values["radius"]))
        for name, value in values.items():
            self._columns[name][row] = value
        self._count_length(row, 1.0)

    def _count_length(self, row: int, sign: float) -> None:
        """Enter the feature length of a row into the sums, or take it out."""
        if self.length_ratio[row] > 0.0:
            length = np.log(self.radius[row] / self.length_ratio[row])
            self.lengths += sign * np.array([1.0, length, length * length])

    def remove(self, rows) -> None:
        """Take rows out of use; their numbers are never given again."""
        for row in rows:
            self._count_length(row, -1.0)
        self.alive[rows] = self.outline_open[rows] = False
        self.radius[rows] = 0.0
        self.weight[rows] = -np.inf
        for row in rows:
            self.index.remove(row)
            self.residuals.pop(row, None)

    def drop_last(self) -> None:
        """Take back the last row."""
        self._count_length(self.size - 1, -1.0)
        self.size -= 1
        self.index.remove(self.size)

    @property
    def rows(self) -> np.ndarray:
        """The rows in use, ascending."""
        return np.flatnonzero(self.alive)

    def extend(self, columns: dict[str, np.ndarray]) -> None:
        """Add many rows at once, all columns given."""
        self.size += len(columns["radius"])
        for name, old in self._columns.items():
            new = np.asarray(columns[name], old.dtype)
            self._columns[name] = np.concatenate([old[: self.size - len(new)], new])
        for row in self.rows.tolist():
            self.index.insert(row, self.origin[row], self.radius[row])

    def renew_rings(self, rows) -> None:
        """Lay the outlines of rows on their polynomials as they are now."""
        self.outline[rows] = self._fresh_rings(rows)

    def ring_shifts(self, rows) -> np.ndarray:
        """(m,) by how much, in radii, the outlines of rows would move if they were laid now."""
        offset = self._fresh_rings(rows) - self.outline[rows]
        return np.sqrt((offset * offset).sum(axis=-1)).max(axis=1) / self.radius[rows]

    def ring_fits(self, rows) -> np.ndarray:
        """(m,) whether outlines of rows would lie within their cores if they were laid now: origins
        move, sites do not, and what is beyond a core is not its patch's to cover."""
        out = self._fresh_rings(rows) - self.site[rows][:, None]
        return (out * out).sum(axis=-1).max(axis=1) <= _OWN * self.weight[rows]

    def _fresh_rings(self, rows) -> np.ndarray:
        scaled = outlines(self.basis, self.mean[rows], self.core) * self.radius[rows][:, None, None]
        return scaled @ self.axes[rows] + self.origin[rows][:, None]

    def scaled_local(self, rows, points) -> np.ndarray:
        """(m, n, 3) points (m, n, 3) or (n, 3) in each row's frame over its radius."""
        local = (points - self.origin[rows][:, None]) @ self.axes[rows].transpose(0, 2, 1)
        return local / self.radius[rows][:, None, None]

    def surface(self, rows, scaled, terms=None):
        """F = z - phi of each row's polynomial (m, n), scaled, and its gradient (m, n, 3), local:
        upward normals that are not of unit length. ``terms`` are the monomials, if at hand."""
        if terms is None:
            terms = monomials(self.basis, scaled[..., 0], scaled[..., 1], scaled[..., 2])
        phi, px, py, pz = evaluate_batch(self.basis, self.mean[rows], terms, GRADIENT)
        upward = np.empty((*px.shape, 3))
        upward[..., 0], upward[..., 1], upward[..., 2] = -px, -py, 1.0 - pz
        return scaled[..., 2] - phi, upward

    def equations(self, rows) -> NormalEquations:
        """The rows' normal equations, a stack."""
        gram = self.products.gram(self.moments[rows])
        return NormalEquations(gram, self.rhs[rows], self.sum_of_squares[rows], self.count[rows])

    def variance_at(self, rows, terms) -> np.ndarray:
        """(m, n) variance, scaled, of each row's phi at points with monomials (m, t, n)."""
        return np.maximum(self.products.values(self.variance[rows], terms), 0.0)

    def noise_scaled(self, rows) -> np.ndarray:
        """(m,) noise over patch radius."""
        return scaled_noise(self.noise[rows], self.radius[rows])
