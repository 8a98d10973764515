"""Which samples each patch learned from, and how it learns more of them."""

import numpy as np

from touchatlas.atlas.moments import absorb, of_patch, solve
from touchatlas.atlas.samples import SamplePool
from touchatlas.atlas.table import Table
from touchatlas.patch.fit import FitOptions, PatchFit
from touchatlas.patch.frame import DarbouxFrame
from touchatlas.patch.refit import refit_patch
from touchatlas.patch.smoothness import SmoothnessPrior
from touchatlas.patch.start import UnfitError

# A patch is framed anew when it knows this many times the samples of its last frame, or when
# its tangent plane at the origin has turned by so much (radians).
_GROWN, _TURNED = 3.0, 0.02
# Samples this much farther out than a patch reaches are offered to a fit of it.
_OFFER_REACH = 1.25
# Feature lengths within one object differ by no less than this, as a standard deviation of
# their logarithm, however alike those seen so far were.
_LEAST_LOG_STD = 0.5


def prior_of(lengths: np.ndarray) -> SmoothnessPrior:
    """The feature length to expect, from those of the patches so far: their count, the sum of
    their logarithms and that of its squares."""
    count, total, squares = lengths.tolist()
    if count < 2.5:
        return SmoothnessPrior()
    mean = total / count
    spread = np.sqrt(max(squares / count - mean * mean, 0.0))
    return SmoothnessPrior(mean, max(float(spread), _LEAST_LOG_STD))


class Learning:
    """The samples of an atlas, and for each patch those in its equations.

    Parameters
    ----------
    table : Table

    Attributes
    ----------
    pool : SamplePool
    members : list of (n,) int
        Indices of the samples in the equations of each row, ascending.
    brought : list of (n,) int
        Indices of the samples that the touches of each row brought.
    """

    def __init__(self, table: Table) -> None:
        self._table = table
        self.pool = SamplePool()
        self.members: list[np.ndarray] = []
        self.brought: list[np.ndarray] = []

    def brought_by(self, rows) -> np.ndarray:
        """Indices of all samples that touches of the rows brought, ascending."""
        parts = [self.brought[i] for i in rows]
        return np.sort(np.concatenate(parts)) if parts else np.zeros(0, np.int32)

    def teach(self, rows: np.ndarray, index: np.ndarray) -> None:
        """Let every row (m,) learn those of new samples (n,) that are of its sheet."""
        member = of_patch(self._table, rows, self.pool.points[index], self.pool.normals[index])
        absorb(self._table, rows, self.pool, index, member)
        for i, mine in zip(rows.tolist(), member, strict=True):
            self.members[i] = np.concatenate([self.members[i], index[mine]])

    def forget(self, row: int) -> None:
        """A row that is no more has no samples."""
        self.members[row] = self.brought[row] = np.zeros(0, np.int32)

    def rebuild(self, row: int) -> None:
        """Equations of a row from scratch, of the same samples."""
        table, rows = self._table, np.array([row])
        for name in ("moments", "right", "square", "count"):
            getattr(table, name)[row] = 0.0
        index = self.members[row]
        absorb(table, rows, self.pool, index, np.ones((1, len(index)), bool))

    def outgrown(self, rows: np.ndarray) -> np.ndarray:
        """Those of the rows whose frame is due to be made anew."""
        table = self._table
        slope = np.abs(table.mean[rows, 1:3]).max(axis=1)
        grown = table.count[rows] >= _GROWN * table.learned[rows]
        return rows[grown | (slope > _TURNED)]

    def refit(self, row: int, offered: np.ndarray, bias, floor, prior, options) -> PatchFit | None:
        """Choose frame and prior of a row anew, from offered samples (n,) that are of its sheet.

        None, and nothing changed, when one polynomial does not hold them.
        """
        fit = self.fit(row, offered, bias, floor, prior, options)
        if fit is not None:
            self.settle(row, fit, offered)
        return fit

    def fit(
        self,
        row: int,
        offered,
        bias: float,
        floor: float,
        prior: SmoothnessPrior,
        options: FitOptions,
    ) -> PatchFit | None:
        """The patch in the place of a row that offered samples make."""
        table, pool = self._table, self.pool
        points, normals = pool.points[offered], pool.normals[offered]
        near = of_patch(table, np.array([row]), points, normals, _OFFER_REACH)[0]
        try:
            return refit_patch(
                DarbouxFrame(table.origin[row], table.axes[row]),
                points[near],
                pool.across[offered][near],
                float(table.noise[row]),
                float(table.radius[row]),
                bias,
                floor,
                prior,
                options,
            )
        except UnfitError:
            return None

    def settle(self, row: int, fit: PatchFit, offered) -> None:
        """Enter a fit in the place of a row, with equations of the offered samples."""
        table = self._table
        table.renew(row, fit)
        self.members[row] = np.zeros(0, np.int32)
        self.teach(np.array([row]), offered)
        table.learned[row] = table.count[row]
        solve(table, np.array([row]))
