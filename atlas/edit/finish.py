"""Finishing: what an exploration ends with, before its surface is drawn."""

from touchatlas.atlas.edit.fill import fill
from touchatlas.atlas.edit.refresh import update_creases
from touchatlas.atlas.edit.simplify import simplify
from touchatlas.atlas.edit.split import split
from touchatlas.atlas.residual.learn_residuals import learn_residuals
from touchatlas.atlas.state import AtlasState


def finish(state: AtlasState) -> int:
    """Refit all patches, fill what lies between them, merge what one patch explains, and learn the
    residuals; how many patches have one.

    Finishing again changes little: what is fitted, filled and merged stays so.
    """
    refit_all(state)
    fill(state)
    simplify(state)
    return update_residuals(state)


def refit_all(state: AtlasState) -> None:
    """Refit all patches from all they could have learned from, and split those that do not hold."""
    state.refit(state.table.rows)
    for row in state.too_large(state.table.rows):
        if state.table.alive[row]:
            split(state, row)
    update_creases(state, state.table.rows.tolist())


def update_residuals(state: AtlasState) -> int:
    """Detail finer than the patches, where the evidence asks for it; how many have it.

    To be called when the surface is wanted: a patch that learns from a later touch loses its
    residual.
    """
    before = set(state.table.residuals)
    state.residual_scale = learn_residuals(state.table, state.membership, state.prior)
    if changed := before | set(state.table.residuals):
        update_creases(state, sorted(changed))
    return len(state.table.residuals)
