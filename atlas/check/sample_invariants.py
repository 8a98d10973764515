"""Sample invariants: owners of samples, normal equations, and what is solved from them."""

from collections.abc import Iterator
from copy import deepcopy

import numpy as np

from touchatlas.atlas.patches.normal_equations import covariance_of, solve, sums_of
from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.atlas.residual.learn_residuals import samples_of, solve_patch_residual
from touchatlas.atlas.state import AtlasState

# Largest error of sums over the same numbers in another order, over the largest of them, and of
# the products of unit vectors; no unit: far above rounding. Doubled, nothing else passes.
ROUNDING = 1e-9
# Largest error of what is solved from such sums, in standard deviations: their rounding times their
# condition. Doubled, coefficients may be off by two millionths of their deviation.
_SOLVED = 1e-6
# Largest rounding of a root mean square residual, in patch radii: a sum of squares is a difference
# of sums, so its rounding counts as a square root. Doubled, smaller wrong residuals pass.
_RESIDUAL_ROUNDING = 10.0 * np.sqrt(np.finfo(float).eps)


def sample_violations(state: AtlasState) -> list[str]:
    """A sentence for each invariant that does not hold."""
    found = list(_samples(state))
    # The other checks look up the samples, so these must be there.
    checks = () if found else (_equations, _solutions, _residuals, _edge_ends, _lost_ends)
    return found + [sentence for check in checks for sentence in check(state)]


def _samples(state: AtlasState) -> Iterator[str]:
    """Each sample has one owner, patches are fitted to samples that are there, and these have
    finite points and unit normals."""
    membership, pool = state.membership, state.membership.pool
    alive = set(state.table.rows.tolist())
    every = np.concatenate([np.zeros(0, int), *membership.owned])
    if not np.array_equal(np.sort(every), np.arange(len(pool))):
        yield "a sample is owned by no patch, or by two"
    for row, (fitted, owned) in enumerate(zip(membership.fitted, membership.owned, strict=True)):
        if len(fitted) != len(np.unique(fitted)):
            yield f"patch {row} learned a sample twice"
        if len(fitted) and not (fitted.min() >= 0 and fitted.max() < len(pool)):
            yield f"patch {row} learned a sample that is not there"
        if row in alive and not len(fitted):
            yield f"patch {row} knows no sample"
        if row not in alive and len(fitted) + len(owned):
            yield f"patch {row} is removed but has samples"
    if not np.isfinite(pool.points).all():
        yield "a sample's point is not finite"
    if not _are_unit(pool.normals):
        yield "a sample's normal is not of unit length"
    if not _are_unit(pool.across[pool.across.any(axis=1)]):
        yield "the normal of a sample's plane is not of unit length"


def _are_unit(vectors) -> bool:
    """Whether vectors (n, 3) are of unit length."""
    return bool(np.allclose((vectors * vectors).sum(axis=1), 1.0, atol=_SOLVED))


def _equations(state: AtlasState) -> Iterator[str]:
    """The normal equations of each patch are the sums over its samples."""
    table, membership = state.table, state.membership
    for row in table.rows.tolist():
        index = membership.fitted[row]
        every = np.ones((1, len(index)), bool)
        moments, rhs, square = sums_of(table, np.array([row]), membership.pool, index, every)
        scale = ROUNDING * np.abs(moments).max()
        if table.count[row] != len(index):
            yield f"patch {row} counts other samples than it learned"
        elif np.abs(moments[0] - table.moments[row]).max() > scale:
            yield f"the equations (moments) of patch {row} are not those of its samples"
        elif np.abs(rhs[0] - table.rhs[row]).max() > scale:
            yield f"the right side of patch {row} is not that of its samples"
        elif abs(square[0] - table.sum_of_squares[row]) > scale:
            yield f"the sum of squares of patch {row} is not that of its samples"


def without_residuals(table: PatchTable) -> PatchTable:
    """A copy of a table with its patches solved from their normal equations alone."""
    plain = deepcopy(table)
    solve(plain, table.rows)
    return plain


def _solutions(state: AtlasState) -> Iterator[str]:
    """Coefficients, variance and residual follow from the normal equations; where a patch has a
    Gaussian-process residual, coefficients and variance follow from that."""
    table, plain = state.table, without_residuals(state.table)
    for row in table.rows.tolist():
        detail = table.residuals.get(row)
        mean = plain.mean[row] if detail is None else detail.mean
        covariance = covariance_of(plain, row) if detail is None else detail.covariance
        deviation = np.sqrt(np.diagonal(covariance))
        if (np.abs(mean - table.mean[row]) > _SOLVED * deviation).any():
            yield f"the coefficients (mean) of patch {row} do not solve its equations"
        quadratic_forms = table.products.quadratic_forms
        apart = np.abs(quadratic_forms(covariance) - table.variance[row])
        if (apart > _SOLVED * quadratic_forms(np.outer(deviation, deviation))).any():
            yield f"the variance of patch {row} does not follow from its equations"
        least = _RESIDUAL_ROUNDING * table.radius[row]
        if abs(plain.residual[row] - table.residual[row]) > _SOLVED * plain.residual[row] + least:
            yield f"the residual of patch {row} is not that of its samples"


def _residuals(state: AtlasState) -> Iterator[str]:
    """Patches with a residual are in use, and the residual follows from the samples of the patch
    when it is solved again."""
    table, rows = state.table, sorted(state.table.residuals)
    if not set(rows) <= set(table.rows.tolist()):
        yield "a residual is of a removed patch"
    elif rows:
        if not state.residual_scale.amplitude > 0:
            yield "there are residuals but no residual scale"
        learned = samples_of(
            without_residuals(table), state.membership, np.array(rows), state.residual_scale
        )
        for i, row in enumerate(rows):
            detail, samples = table.residuals[row], learned.only(i)
            if not all(
                (mine := getattr(detail.samples, name)).shape == theirs.shape
                and np.allclose(mine, theirs, rtol=_SOLVED, atol=_SOLVED)
                for name, theirs in vars(samples).items()
            ):
                yield f"the residual of patch {row} is of other samples than the patch"
            again = solve_patch_residual(table.basis, detail.samples, detail.shape)
            if not all(
                np.allclose(mine, vars(again.residual)[name], rtol=_SOLVED, atol=0.0)
                for name, mine in vars(detail.residual).items()
            ) or not np.allclose(detail.mean, again.mean, rtol=_SOLVED):
                yield f"the residual of patch {row} does not follow from its samples"


def _edge_ends(state: AtlasState) -> Iterator[str]:
    """Ends at edges are samples, of patches in use, with a tangent, a normal and a step."""
    ends = state.edge_ends
    if not set(ends.home.tolist()) <= set(state.table.rows.tolist()):
        yield "an end at an edge is at home at a removed patch"
    if not _among(ends.points, state.membership.pool.points):
        yield "an end at an edge is no sample"
    level = np.abs((ends.tangents * ends.normals).sum(axis=1)) <= _SOLVED
    if not (_are_unit(ends.tangents) and _are_unit(ends.normals) and level.all()):
        yield "tangent and normal of an end at an edge are no frame"
    if (ends.steps <= 0).any():
        yield "an end at an edge has no sampling step"


def _lost_ends(state: AtlasState) -> Iterator[str]:
    """Ends at which contact was lost have a finite place, a tangent, a normal and a step."""
    ends = state.rims.ends
    if not np.isfinite(ends.points).all():
        yield "an end at which contact was lost is not finite"
    if not (_are_unit(ends.tangents) and _are_unit(ends.normals)):
        yield "tangent or normal of an end at which contact was lost is not of unit length"
    if not ((ends.steps > 0) & np.isfinite(ends.steps)).all():
        yield "an end at which contact was lost has no sampling step"


def _among(points, others) -> bool:
    """Whether all of points (n, 3) are among others (m, 3), to the last bit."""
    return {p.tobytes() for p in points} <= {p.tobytes() for p in others} if len(points) else True
