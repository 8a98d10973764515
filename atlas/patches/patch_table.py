"""PatchTable: one growing array for each property of the patches, with one row for each patch."""

from copy import copy

import numpy as np

from touchatlas.atlas.patches.ball_index import BallIndex
from touchatlas.atlas.patches.growing_array import grown
from touchatlas.atlas.patches.monomial_products import products
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.smoothness import NormalEquations, scaled_noise
from touchatlas.patch.geometry.polynomial import GRADIENT, Basis, evaluate_batch, monomials

# Number of patches that a new table has room for. Doubled, it takes 140 kB more.
_ROOM = 64


class PatchTable:
    """The patches of an atlas as arrays over all of them: one numpy call handles many patches.

    Parameters
    ----------
    basis : Basis
        Monomials of every patch's polynomial; there are t.
    core : float
        Fraction of its radius within which a patch covers the surface.

    Attributes
    ----------
    size : int
        Number of rows. A removed patch keeps its row.
    index : BallIndex
        Balls about the patch origins with the patch radii.
    residuals : dict of int to PatchResidual
        The Gaussian processes of the rows that have one.
    lengths : (3,) float
        Number of patches with a feature length, sum of the logarithms of these lengths, and sum of
        the squares of the logarithms.
    products : Products
        The p different products of two monomials: ``moments`` and ``variance`` are over these.

    Notes
    -----
    Each column is an attribute, an array (size, ...). *Scaled* means divided by the patch radius.

    ===================  ======  ========  =========================================================
    column               shape   unit      meaning
    ===================  ======  ========  =========================================================
    alive                        bool      whether the patch is in use
    site                 3       length    centre of the core, world; a refit does not move it
    origin               3       length    origin of the frame, world
    axes                 3, 3    unit      rows e1, e2 and outward normal, world
    radius                       length    of validity about the origin; 0 when removed
    weight                       length^2  squared core radius; -inf when removed
    noise                        length    standard deviation of a sample, with a part of the bias
    measurement_std              length    standard deviation of a sample, of the probe alone
    length_ratio                 1         prior: radius over feature length
    z_scale                      1         prior: factor of the deviations for each power of z
    condition                    1         condition number of the sections of the first frame
    moments              p       scaled    normal equations: sum of w phi phi^t
    rhs                  t       scaled    normal equations: sum of w phi z
    sum_of_squares               scaled    normal equations: sum of w z^2
    count                        1         number of samples in the equations
    learned                      1         ``count`` at the last refit
    linearisation_point  t       scaled    coefficients of the last refit
    mean                 t       scaled    coefficients
    variance             p       scaled    variance of phi, as a polynomial over the products
    residual                     length    root mean square of the samples' distances
    ===================  ======  ========  =========================================================
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
        }
        kinds = {"alive": bool}
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
        """Append one fitted patch; returns its row."""
        row = self._make_room(1)
        self.size += 1
        self._begin(row, fit)
        self._count_length(row, 1.0)
        self.index.insert(row, fit.patch.frame.origin, fit.patch.radius)
        return row

    def append_copy(self, values: dict[str, np.ndarray]) -> int:
        """Append one patch, given every column as ``copy_of`` returns them; returns its row."""
        row = self._make_room(1)
        self.size += 1
        for name, value in values.items():
            self._columns[name][row] = value
        self._count_length(row, 1.0)
        self.index.insert(row, values["origin"], float(values["radius"]))
        return row

    def with_candidate(self, fit: PatchFit) -> tuple["PatchTable", int]:
        """A table with one more patch, and the row of that patch; this table is not changed.

        The two tables share their columns, so no array is copied. The candidate is valid until the
        next ``append`` or ``with_candidate``. The index does not hold it.
        """
        trial, rows = self.with_candidates([fit])
        return trial, int(rows[0])

    def with_candidates(self, fits: list[PatchFit]) -> tuple["PatchTable", np.ndarray]:
        """The same with several more patches, and their rows (m,)."""
        first, trial = self._make_room(len(fits)), copy(self)
        trial.size += len(fits)
        for row, fit in enumerate(fits, first):
            trial._begin(row, fit)
        return trial, np.arange(first, trial.size)

    def _make_room(self, count: int) -> int:
        """The next row; every column has room for it and for ``count`` rows in all."""
        for name, column in self._columns.items():
            self._columns[name] = grown(column, self.size + count)
        return self.size

    def _begin(self, row: int, fit: PatchFit) -> None:
        """Write a fit into a new row; the site is the origin of the patch from now on."""
        patch = fit.patch
        self.site[row] = patch.frame.origin
        self.alive[row] = True
        self.weight[row] = (self.core * patch.radius) ** 2
        self.condition[row] = patch.condition
        self.measurement_std[row] = self.learned[row] = 0.0
        self._fill(row, fit)

    def replace(self, row: int, fit: PatchFit) -> None:
        """Replace the patch of a row by a refit with empty equations; site and weight stay."""
        self._count_length(row, -1.0)
        self.index.move(row, fit.patch.frame.origin, fit.patch.radius)
        self._fill(row, fit)
        self._count_length(row, 1.0)

    def _fill(self, row: int, fit: PatchFit) -> None:
        """Write a fit into a row, with empty equations."""
        patch = fit.patch
        self.origin[row], self.axes[row] = patch.frame.origin, patch.frame.axes
        self.radius[row], self.noise[row] = patch.radius, patch.noise_std
        self.length_ratio[row], self.z_scale[row] = fit.length_ratio, fit.z_scale
        self.moments[row] = self.rhs[row] = self.sum_of_squares[row] = self.count[row] = 0.0
        self.linearisation_point[row] = self.mean[row] = patch.polynomial.coefficients
        self.variance[row] = self.products.quadratic_forms(patch.covariance)
        self.residual[row] = patch.residual_rms

    def copy_of(self, row: int) -> dict[str, np.ndarray]:
        """A copy of every column at a row, for ``put_back`` and ``append_copy``."""
        return {name: column[row].copy() for name, column in self._columns.items()}

    def put_back(self, row: int, values: dict[str, np.ndarray]) -> None:
        """Restore a row from what ``copy_of`` returned."""
        self._count_length(row, -1.0)
        self.index.move(row, values["origin"], float(values["radius"]))
        for name, value in values.items():
            self._columns[name][row] = value
        self._count_length(row, 1.0)

    def _count_length(self, row: int, sign: float) -> None:
        """Add the feature length of a row to ``lengths``, or subtract it where the sign is -1."""
        if self.length_ratio[row] > 0.0:
            length = np.log(self.radius[row] / self.length_ratio[row])
            self.lengths += sign * np.array([1.0, length, length * length])

    def remove(self, rows) -> None:
        """Remove patches; their rows are never used again."""
        for row in rows:
            self._count_length(row, -1.0)
        self.alive[rows] = False
        self.radius[rows] = 0.0
        self.weight[rows] = -np.inf
        for row in rows:
            self.index.remove(row)
            self.residuals.pop(row, None)

    @property
    def rows(self) -> np.ndarray:
        """The rows of the patches in use, ascending."""
        return np.flatnonzero(self.alive)

    def extend(self, columns: dict[str, np.ndarray]) -> None:
        """Append many rows, given every column."""
        self.size += len(columns["radius"])
        for name, old in self._columns.items():
            new = np.asarray(columns[name], old.dtype)
            self._columns[name] = np.concatenate([old[: self.size - len(new)], new])
        for row in self.rows.tolist():
            self.index.insert(row, self.origin[row], self.radius[row])

    def scaled_local(self, rows, points) -> np.ndarray:
        """(m, n, 3) world points (m, n, 3) or (n, 3) in each row's frame, over its radius."""
        local = (points - self.origin[rows][:, None]) @ self.axes[rows].transpose(0, 2, 1)
        return local / self.radius[rows][:, None, None]

    def surface(self, rows, scaled, terms=None):
        """F = z - phi of each row (m, n), scaled, and its gradient (m, n, 3), local, at points
        (m, n, 3), scaled. The gradient points outward and is not of unit length.

        ``terms`` are the monomials at the points, if they are known already.
        """
        if terms is None:
            terms = monomials(self.basis, scaled[..., 0], scaled[..., 1], scaled[..., 2])
        phi, px, py, pz = evaluate_batch(self.basis, self.mean[rows], terms, GRADIENT)
        upward = np.empty((*px.shape, 3))
        upward[..., 0], upward[..., 1], upward[..., 2] = -px, -py, 1.0 - pz
        return scaled[..., 2] - phi, upward

    def equations(self, rows) -> NormalEquations:
        """The normal equations of rows, as one stack."""
        gram = self.products.gram(self.moments[rows])
        return NormalEquations(gram, self.rhs[rows], self.sum_of_squares[rows], self.count[rows])

    def variance_at(self, rows, terms) -> np.ndarray:
        """(m, n) variance of each row's phi, scaled, at points with monomials (m, t, n)."""
        return np.maximum(self.products.values(self.variance[rows], terms), 0.0)

    def noise_scaled(self, rows) -> np.ndarray:
        """(m,) noise over patch radius, kept above the rounding of the solver."""
        return scaled_noise(self.noise[rows], self.radius[rows])
