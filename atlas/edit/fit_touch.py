"""Fit touch: the patch of one touch alone, or why there is none."""

import numpy as np

from touchatlas.atlas.edit.grazing_touch import grazes, known_side, turned
from touchatlas.atlas.edit.near_arcs import near_arc
from touchatlas.atlas.edit.replace import in_ball
from touchatlas.atlas.records.touch import LEAST_POINTS, Touch
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import PatchFit, fit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.contour import Contour

# Length that a contour must exceed, in standard deviations of its noise. At this length the
# direction of five samples is off by 9 degrees. Doubled, by 4 degrees, and fewer contours in the
# corners of faces count.
_LEAST_LENGTH = 10.0
# Largest core radius over the one at which the core would take an earlier site out of its cell, no
# unit. With twice the margin a few cores are 1 % smaller.
_CLEAR = 0.99
# Least number of samples within the radius of a touch's patch: two for each section. Doubled,
# touches beside edges are repeated with finer steps more often.
_LEAST_SAMPLES = 6
# Sections that the principal curvatures need (do Carmo, section 3-2). With twice as many a touch
# would be refused where three of its contours suffice.
LEAST_CONTOURS = 3


def fit_or_reason(state: AtlasState, touch: Touch, contours) -> tuple[PatchFit | None, str]:
    """The patch of a touch alone, or None and why there is none."""
    if len(contours) < LEAST_CONTOURS:
        return None, few_contours(len(contours))
    try:
        fit = _fit(state, touch, contours)
        if reason := _too_few(fit, contours):
            return None, reason
        if not grazes(fit, touch):
            return fit, ""
        side = known_side(state, fit)
        if side == 0:
            return None, (
                "the probe came nearly along the surface, so that its outer side is not known; "
                "come along the normal"
            )
        return (_fit(state, turned(touch), contours) if side < 0 else fit), ""
    except UnfitError as error:
        return None, str(error)


def few_contours(count: int) -> str:
    """Why a touch with so many contours that are long enough gives no patch."""
    return (
        f"contours of {LEAST_POINTS} points or more: {count}; a patch needs {LEAST_CONTOURS}: "
        "track more planes, or sample more finely"
    )


def _too_few(fit: PatchFit, contours) -> str:
    """Why a fit has no samples to rest on; empty where it has enough. Beside an edge its radius may
    be less than the distance between samples."""
    frame, radius = fit.patch.frame, fit.patch.radius
    points = np.concatenate([contour.points for contour in contours])
    count = np.count_nonzero(in_ball(points, frame.origin, radius))
    if count >= _LEAST_SAMPLES:
        return ""
    return (
        f"{count} samples lie within {radius:.3g} of the contact, where the contours are smooth; a "
        f"patch needs {_LEAST_SAMPLES}: sample more finely there"
    )


def _fit(state: AtlasState, touch: Touch, contours) -> PatchFit:
    """The patch of one touch alone, from those of its contours that are long enough.

    Raises
    ------
    UnfitError
        When no patch fits the contours.
    """
    options, scale = state.options, state.scale
    # Long arms come with filling; short ones turn less than their patch may.
    arcs = [near_arc(c, touch.contact) for c in contours] if state.fills else contours
    return fit_patch(
        touch.contact,
        tuple(arc for arc in arcs if _has_direction(arc, touch.contact)),
        touch.approach,
        bias=options.bias * scale,
        detail=state.detail,
        radius_floor=options.least_radius * scale,
        radius_limit=_radius_limit(state, touch),
        prior=state.prior,
        options=options.fit,
    )


def _has_direction(contour: Contour, contact) -> bool:
    """Whether a contour goes farther from the contact than its noise explains. In the corner of a
    face it may not."""
    return not in_ball(contour.points, contact, _LEAST_LENGTH * contour.noise_std).all()


def _radius_limit(state: AtlasState, touch: Touch) -> float:
    """Largest patch radius with which the site of no earlier touch falls into the cell of the new
    patch, length; infinite when none is near the contours."""
    table = state.table
    ends = np.concatenate([c.points for c in touch.contours]) - touch.contact
    reach = max(state.options.least_radius * state.scale, np.sqrt((ends**2).sum(1).max()))
    rows = table.index.rows_near(touch.contact, table.core * float(reach) / _CLEAR)
    rows = rows[table.axes[rows, 2] @ touch.approach > 0]
    if state.fills:
        rows = np.array([row for row in rows.tolist() if not state.membership.is_filled(row)], int)
    offset = table.site[rows] - touch.contact
    square = (offset * offset).sum(axis=1) + table.weight[rows]
    return float(_CLEAR * np.sqrt(square.min()) / table.core) if len(rows) else np.inf
