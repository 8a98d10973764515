"""Finish: the steps that end an exploration, before its surface is drawn."""

from touchatlas.atlas.edit.fill import fill
from touchatlas.atlas.residual.learn_residuals import learn_residuals
from touchatlas.atlas.state import AtlasState


def finish(state: AtlasState) -> int:
    """Fill what is open, and learn the residuals; returns how many patches have a residual.

    Where touches were not filled between as they arrived, all patches are refitted first. Where
    faces describe the whole body, nothing is left to do. A second call changes little.
    """
    if state.body is not None:
        return len(state.table.residuals)
    if not state.fills:
        refit_all(state)
    fill(state)
    return update_residuals(state)


def refit_all(state: AtlasState) -> None:
    """Refit all patches from all samples about them."""
    state.refit(state.table.rows)


def update_residuals(state: AtlasState) -> int:
    """Learn the detail that polynomials leave out, where the evidence favours it; returns how many
    patches have a residual.

    A patch that learns from a later touch loses its residual.
    """
    before = set(state.table.residuals)
    state.residual_scale = learn_residuals(state.table, state.membership, state.prior)
    if changed := before | set(state.table.residuals):
        state.surface_graph.mark_stale(changed)
    return len(state.table.residuals)
