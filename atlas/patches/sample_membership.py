"""SampleMembership: which patch owns each sample, and which samples each patch is fitted to."""

import numpy as np

from touchatlas.atlas.patches.normal_equations import SHEET_COSINE, absorb, of_patch, solve
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.patches.sample_index import SampleIndex
from touchatlas.atlas.patches.sample_pool import SamplePool
from touchatlas.patch.fit.fit_patch import PatchFit
from touchatlas.patch.fit.refit_patch import refit_patches
from touchatlas.patch.fit.smoothness import SmoothnessPrior
from touchatlas.patch.fit.start import Stack, UnfitError

# A patch is refitted when its sample count is this many times that of the last refit. Doubled,
# patches keep their first frame and prior for longer.
_GROWN = 3.0
# It is also refitted when its sample count has grown by this factor and the slope of its polynomial
# at the origin exceeds this tangent. The factor stops endless refits where no polynomial fits all
# samples. Doubled, frames tilt by up to 2 degrees.
_GROWN_TILTED, _TILTED = 1.2, 0.02
# Distance from its origin within which samples are candidates for the refit of a patch, in patch
# radii: the frame of the refit may differ. Doubled, most candidates are rejected.
CANDIDATE_REACH = 1.25
# Number of candidates that are fitted in one numpy call, so that they fit the caches. Doubled, a
# call takes twice the memory.
_AT_ONCE = 1 << 14
# Least standard deviation of the logarithm of the feature length that is expected of the next
# patch, however alike those so far are. Doubled, the prior restrains new patches less.
_LEAST_LOG_STD = 0.5


def prior_of(lengths: np.ndarray) -> SmoothnessPrior:
    """The prior that the patches so far give for the next one.

    Parameters
    ----------
    lengths : (3,) float
        Number of feature lengths, sum of their logarithms, sum of the squares of the logarithms.
    """
    count, total, squares = lengths.tolist()
    if count < 2.5:
        return SmoothnessPrior()
    mean = total / count
    spread = np.sqrt(max(squares / count - mean * mean, 0.0))
    return SmoothnessPrior(mean, max(float(spread), _LEAST_LOG_STD))


class SampleMembership:
    """The samples of an atlas: each has one owner, and several patches may be fitted to it.

    Parameters
    ----------
    table : PatchTable

    Attributes
    ----------
    pool : SamplePool
    fitted : list of (n,) int
        Indices of the samples in the equations of each row.
    owned : list of (n,) int
        Indices of the samples that each row owns: those of the contours that made the patch, and
        those that passed to it from removed patches.
    """

    def __init__(self, table: PatchTable) -> None:
        self._table = table
        self.pool = SamplePool()
        self._index = SampleIndex()
        self.fitted: list[np.ndarray] = []
        self.owned: list[np.ndarray] = []

    def owned_by(self, rows) -> np.ndarray:
        """(n,) indices of all samples that the rows own, ascending."""
        parts = [self.owned[i] for i in rows]
        return np.sort(np.concatenate(parts)) if parts else np.zeros(0, np.int32)

    def fitted_by(self, rows) -> np.ndarray:
        """(n,) indices of all samples in the equations of any of the rows, ascending."""
        found = np.zeros(len(self.pool), bool)
        for i in rows:
            found[self.fitted[i]] = True
        return np.flatnonzero(found)

    def known_about(self, rows, table: PatchTable | None = None) -> list[np.ndarray]:
        """For each row, of another table if one is given, the indices (n,) of the samples that it
        may be fitted to, ascending: those near its origin whose normals are within 60 degrees of
        its own, whoever owns them."""
        table = self._table if table is None else table
        return self.near(
            table.origin[rows], table.axes[rows, 2], CANDIDATE_REACH * table.radius[rows]
        )

    def of_sheet(self, row: int, neighbours) -> np.ndarray:
        """(n,) indices of the samples that a row and its neighbours own, and, of a filled patch,
        that it is fitted to, ascending."""
        owned = self.owned_by([row, *neighbours])
        return owned if len(self.owned[row]) else np.union1d(self.fitted[row], owned)

    def near(self, centres, normals, radii) -> list[np.ndarray]:
        """For each of m balls the indices (n,) of the samples in it whose normals are within 60
        degrees of a normal, ascending.

        Parameters
        ----------
        centres, normals : (m, 3) float, length; unit, world
        radii : (m,) float, length
        """
        found = self._index.near(self.pool.points, centres, radii)
        return [
            index[self.pool.normals[index] @ normal >= SHEET_COSINE]
            for index, normal in zip(found, normals, strict=True)
        ]

    def in_ball(self, centre, radius: float) -> np.ndarray:
        """(n,) indices of the samples in a ball, whichever way they face."""
        return self._index.near(self.pool.points, centre[None], np.array([radius]))[0]

    def count_near(self, centres, radii) -> np.ndarray:
        """(m,) number of samples in each of m balls, centres (m, 3) and radii (m,), length."""
        return self._index.count(self.pool.points, centres, radii)

    def is_filled(self, row: int) -> bool:
        """Whether a patch lies between touches: it owns no sample."""
        return not len(self.owned[row])

    def learn(self, rows: np.ndarray, index: np.ndarray) -> None:
        """Add new samples ``index`` (n,) to the equations of those of rows (m,) whose sheet they
        are of."""
        member = of_patch(self._table, rows, self.pool.points[index], self.pool.normals[index])
        absorb(self._table, rows, self.pool, index, member)
        for i, accepted in zip(rows.tolist(), member, strict=True):
            self.fitted[i] = np.concatenate([self.fitted[i], index[accepted]])

    def append(self) -> None:
        """Append a row without samples."""
        nothing = np.zeros(0, np.int32)
        self.fitted.append(nothing)
        self.owned.append(nothing)

    def drop(self, row: int) -> None:
        """Take all samples from a row that is removed."""
        self.fitted[row] = self.owned[row] = np.zeros(0, np.int32)

    def outgrown(self, rows: np.ndarray) -> np.ndarray:
        """The rows that are due for a refit: see ``_GROWN`` and ``_GROWN_TILTED``."""
        table = self._table
        slope = np.abs(table.mean[rows, 1:3]).max(axis=1)
        count, learned = table.count[rows], table.learned[rows]
        due = (count >= _GROWN * learned) | ((count >= _GROWN_TILTED * learned) & (slope > _TILTED))
        return rows[due & (count > learned)]

    def refit(self, rows, candidates, bias: float, prior: SmoothnessPrior, options) -> None:
        """Refit rows: choose frames, priors and coefficients again from candidate samples.

        Parameters
        ----------
        rows : (m,) int
        candidates : m arrays of int
            Indices of samples. Each row is fitted to those that are of its sheet.
        bias : float, length
            Lack of fit that counts as if it were noise.
        prior : SmoothnessPrior
        options : FitOptions

        Notes
        -----
        A row stays as it was when no polynomial fits, or when the new one accepts no sample.
        """
        counts = np.array([len(index) for index in candidates], int)
        order = np.argsort(counts, kind="stable")
        while len(order):
            step = max(1, _AT_ONCE // max(1, counts[order[0]]))
            chosen, order = order[:step], order[step:]
            samples = CandidateSamples([candidates[i] for i in chosen.tolist()])
            fits = self._fits(np.asarray(rows)[chosen], samples, bias, prior, options)
            good = [i for i, fit in enumerate(fits) if fit is not None]
            if good:
                fitted_rows = np.asarray(rows)[chosen[good]]
                before = [(self._table.copy_of(i), self.fitted[i]) for i in fitted_rows.tolist()]
                found = [fit for fit in fits if fit is not None]
                self.enter_fits(fitted_rows, found, samples.only(good))
                self._restore_empty(fitted_rows, before)

    def _restore_empty(self, rows, before) -> None:
        """Restore those of the rows (m,) that have no sample after their refit."""
        empty = [row for row in rows.tolist() if not len(self.fitted[row])]
        for row, (values, fitted) in zip(rows.tolist(), before, strict=True):
            if row in empty:
                self._table.put_back(row, values)
                self.fitted[row] = fitted
        if empty:
            solve(self._table, np.array(empty))

    def _fits(
        self, rows, candidates: "CandidateSamples", bias, prior, options
    ) -> list[PatchFit | None]:
        """A refit of each row from its candidates; None where no polynomial fits."""
        table, pool = self._table, self.pool
        close = accepted(table, pool, rows, candidates, CANDIDATE_REACH)
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
        # One row without a fit fails the whole stack: fit each row by itself.
        return [
            self._fits(rows[[i]], candidates.only([i]), bias, prior, options)[0]
            for i in range(len(rows))
        ]

    def enter_fits(self, rows, fits: list[PatchFit], candidates: "CandidateSamples") -> None:
        """Replace the patches of rows (m,) by m fits, with equations of the candidate samples that
        are of their sheets."""
        table = self._table
        for row, fit in zip(rows.tolist(), fits, strict=True):
            table.replace(row, fit)
        found = accepted(table, self.pool, rows, candidates, 1.0)
        absorb(table, rows, self.pool, found.index, found.present)
        for i, index, present in zip(rows.tolist(), found.index, found.present, strict=True):
            self.fitted[i] = index[present]
        table.learned[rows] = table.count[rows]
        solve(table, rows)


class CandidateSamples:
    """Candidate samples of each of m rows, as one padded array.

    Parameters
    ----------
    parts : m arrays of int
        Indices of samples.

    Attributes
    ----------
    index : (m, n) int
        Lines are padded with index 0.
    present : (m, n) bool
        False where a line is padded.
    """

    def __init__(self, parts) -> None:
        counts = np.array([len(part) for part in parts])
        self.present = np.arange(counts.max()) < counts[:, None]
        self.index = np.zeros(self.present.shape, np.int32)
        self.index[self.present] = np.concatenate(parts)

    def only(self, rows: list[int]) -> "CandidateSamples":
        """The candidates of some of the m rows."""
        return CandidateSamples([self.index[i][self.present[i]] for i in rows])

    def only_where(self, chosen) -> "CandidateSamples":
        """The candidates where ``chosen`` (m, n) is true."""
        return CandidateSamples(
            [i[keep] for i, keep in zip(self.index, chosen & self.present, strict=True)]
        )


def accepted(
    table: PatchTable, pool: SamplePool, rows, candidates: CandidateSamples, reach: float
) -> CandidateSamples:
    """The candidates that rows (m,) may be fitted to: see ``of_patch``."""
    across = table.scaled_local(rows, pool.points[candidates.index])[..., :2]
    # Most candidates are beyond the reach: the cheap test comes first.
    close = candidates.only_where((across * across).sum(axis=-1) <= reach * reach)
    index = close.index
    member = of_patch(table, rows, pool.points[index], pool.normals[index], reach)
    return close.only_where(member)
