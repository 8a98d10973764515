"""Which samples each patch learned from, and how it learns more of them."""

import numpy as np

from touchatlas.atlas.patches.normal_equations import absorb, of_patch, solve
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_pool import SamplePool
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.refit_patch import refit_patches
from touchatlas.patch.fit.smoothness import SmoothnessPrior
from touchatlas.patch.fit.start import Stack, UnfitError

# A patch is framed anew when it knows this many times the samples of its last frame; or so many
# times, if its tangent plane at the origin has turned by so much (radians): where no polynomial
# holds all samples a new frame may be as askew as the last, and another touch does not mend it.
_GROWN, _GROWN_TURNED, _TURNED = 3.0, 1.2, 0.02
# Samples this much farther out than a patch reaches are offered to a fit of it.
CANDIDATE_REACH = 1.25
# Offered samples of rows that are fitted in one go, for the caches.
_AT_ONCE = 1 << 14
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


class SampleMembership:
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

    def __init__(self, table: PatchTable) -> None:
        self._table = table
        self.pool = SamplePool()
        self.fitted: list[np.ndarray] = []
        self.owned: list[np.ndarray] = []

    def owned_by(self, rows) -> np.ndarray:
        """Indices of all samples that touches of the rows brought, ascending."""
        parts = [self.owned[i] for i in rows]
        return np.sort(np.concatenate(parts)) if parts else np.zeros(0, np.int32)

    def fitted_by(self, rows) -> np.ndarray:
        """Indices of all samples in the equations of any of the rows, ascending."""
        found = np.zeros(len(self.pool), bool)
        for i in rows:
            found[self.fitted[i]] = True
        return np.flatnonzero(found)

    def known_about(self, row: int, neighbours) -> np.ndarray:
        """Indices of what touches of a row and its kin brought, ascending; of a bridge, which
        brought nothing, also what it learned from touches beyond its kin."""
        brought = self.owned_by([row, *neighbours])
        return brought if len(self.owned[row]) else np.union1d(self.fitted[row], brought)

    def learn(self, rows: np.ndarray, index: np.ndarray) -> None:
        """Let every row (m,) learn those of new samples (n,) that are of its sheet."""
        member = of_patch(self._table, rows, self.pool.points[index], self.pool.normals[index])
        absorb(self._table, rows, self.pool, index, member)
        for i, mine in zip(rows.tolist(), member, strict=True):
            self.fitted[i] = np.concatenate([self.fitted[i], index[mine]])

    def append(self) -> None:
        """Enter the next row, which has no sample yet."""
        nothing = np.zeros(0, np.int32)
        self.fitted.append(nothing)
        self.owned.append(nothing)

    def drop(self, row: int) -> None:
        """A row that is no more has no samples."""
        self.fitted[row] = self.owned[row] = np.zeros(0, np.int32)

    def outgrown(self, rows: np.ndarray) -> np.ndarray:
        """Those of the rows whose frame is due to be made anew."""
        table = self._table
        slope = np.abs(table.mean[rows, 1:3]).max(axis=1)
        grown = table.count[rows] / table.learned[rows]
        return rows[(grown >= _GROWN) | ((grown >= _GROWN_TURNED) & (slope > _TURNED))]

    def refit(self, rows, candidates, bias: float, prior: SmoothnessPrior, options) -> None:
        """Choose frames and priors of rows anew, from samples offered to each of them.

        Parameters
        ----------
        rows : (m,) int
        candidates : m arrays of int
            Samples that may be of each row's sheet; those that are, are learned.
        bias : float, length
            Residuals beyond the noise that are borne.
        prior : SmoothnessPrior
        options : FitOptions

        Notes
        -----
        Rows that no polynomial fits, or none that faces any sample, stay as they are.
        """
        counts = np.array([len(index) for index in candidates], int)
        order = np.argsort(counts, kind="stable")
        while len(order):
            step = max(1, _AT_ONCE // max(1, counts[order[0]]))
            some, order = order[:step], order[step:]
            mine, index = (
                np.asarray(rows)[some],
                CandidateSamples([candidates[i] for i in some.tolist()]),
            )
            fits = self._fits(mine, index, bias, prior, options)
            good = [i for i, fit in enumerate(fits) if fit is not None]
            if good:
                some = mine[good]
                before = [(self._table.copy_of(row), self.fitted[row]) for row in some.tolist()]
                self.enter_fits(some, [fit for fit in fits if fit is not None], index.only(good))
                self._take_back(some, before)

    def _take_back(self, rows, before) -> None:
        """Rows that know no sample any more are again what they were."""
        lost = [row for row in rows.tolist() if not len(self.fitted[row])]
        for row, (values, members) in zip(rows.tolist(), before, strict=True):
            if row in lost:
                self._table.put_back(row, values)
                self.fitted[row] = members
        if lost:
            solve(self._table, np.array(lost))

    def _fits(self, rows, offer: "CandidateSamples", bias, prior, options) -> list[PatchFit | None]:
        """The patches in the place of rows that offered samples make; None where they make none."""
        table, pool = self._table, self.pool
        close = self._of_rows(rows, offer, CANDIDATE_REACH)
        stack = Stack(
            table.origin[rows],
            table.axes[rows],
            pool.points[close.index] - table.origin[rows][:, None],
            pool.across[close.index],
            close.present.astype(float),
            table.radius[rows],
            table.noise[rows],
            table.condition[rows],
        )
        try:
            return list(refit_patches(stack, bias, prior, options))
        except UnfitError:
            if len(rows) == 1:
                return [None]
        parts = [
            self._fits(rows[[i]], offer.only([i]), bias, prior, options) for i in range(len(rows))
        ]
        return [fit for part in parts for fit in part]

    def enter_fits(self, rows, fits: list[PatchFit], offer: "CandidateSamples") -> None:
        """Enter fits in the places of rows, with equations of the samples offered to them."""
        table = self._table
        for row, fit in zip(rows.tolist(), fits, strict=True):
            table.replace(row, fit)
        mine = self._of_rows(rows, offer, 1.0)
        absorb(table, rows, self.pool, mine.index, mine.present)
        for i, index, present in zip(rows.tolist(), mine.index, mine.present, strict=True):
            self.fitted[i] = index[present]
        table.learned[rows] = table.count[rows]
        solve(table, rows)

    def _of_rows(self, rows, offer: "CandidateSamples", reach: float) -> "CandidateSamples":
        """Those of the samples offered to rows that they may learn from: see ``of_patch``."""
        table, pool = self._table, self.pool
        across = table.scaled_local(rows, pool.points[offer.index])[..., :2]
        # Most are beyond the reach, and need not be looked at any closer.
        close = offer.only_where((across * across).sum(axis=-1) <= reach * reach)
        index = close.index
        member = of_patch(table, rows, pool.points[index], pool.normals[index], reach)
        return close.only_where(member)


class CandidateSamples:
    """Samples offered to each of m rows, as one array.

    Parameters
    ----------
    parts : m arrays of int
        Indices of samples.

    Attributes
    ----------
    index : (m, n) int
    present : (m, n) bool
        What does not only fill the lines.
    """

    def __init__(self, parts) -> None:
        counts = np.array([len(part) for part in parts])
        self.present = np.arange(counts.max()) < counts[:, None]
        self.index = np.zeros(self.present.shape, np.int32)
        self.index[self.present] = np.concatenate(parts)

    def only(self, rows: list[int]) -> "CandidateSamples":
        """Those to some of the rows."""
        return CandidateSamples([self.index[i][self.present[i]] for i in rows])

    def only_where(self, chosen) -> "CandidateSamples":
        """Those of the samples that are chosen (m, n)."""
        return CandidateSamples(
            [i[keep] for i, keep in zip(self.index, chosen & self.present, strict=True)]
        )
