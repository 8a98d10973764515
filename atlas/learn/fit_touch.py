"""Fit touch: the patch of one touch alone, or why there is none."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.learn.near_arcs import near_arc
from touchatlas.atlas.records.touch import LEAST_POINTS, Touch
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.fit_patch import FitOptions, PatchFit, fit_patch
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.contour import Contour
from touchatlas.patch.geometry.section import contour_normals

# Length that a contour must exceed, in standard deviations of its noise. At this length the
# direction of five samples is off by 9 degrees. Doubled, by 4 degrees, and fewer contours in the
# corners of faces count.
_LEAST_LENGTH = 10.0
# Radius below which contours and residuals make no patch smaller, in scales. Doubled, patches in
# narrow places are wrong.
_LEAST_RADIUS = 10.0
# Cosine between approach and normal below which a touch grazes: 75 degrees. There a normal that is
# off by 15 degrees turns the patch inside out. Doubled, 59 degrees: the touches of steep walls that
# nothing is known about are refused.
_GRAZING = 0.26
# The same above which the approach alone tells the outer side: 60 degrees. Doubled, the known
# surface is asked at every touch, and one that is inside out turns the next touch as well.
_STEEP = 0.5
# Least sum of the weights of samples that tell the side of the known surface: each weighs a half
# where the surface is as sure as one sample, more where it is surer. And the least share of that
# sum by which one side must have more than the other. The first doubled, fewer grazing touches are
# learned; the second, all samples must agree.
_LEAST_SAYS, _AGREES = 0.5, 0.5
# Deviations within which a sample lies on the known surface. Doubled, the far sides of thin walls
# tell the side.
_SURE = 3.0
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
        facing = fit.patch.frame.normal @ touch.approach
        side = 0 if facing >= _STEEP else _known_side(state, fit.patch.frame.normal, contours)
        if side == 0 and facing < _GRAZING:
            return None, (
                "the probe came nearly along the surface, so that its outer side is not known; "
                "come along the normal"
            )
        other = replace(touch, approach=-touch.approach, way=None)
        return (_fit(state, other, contours) if side < 0 else fit), ""
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
    count = np.count_nonzero(_in_ball(points, frame.origin, radius))
    if count >= _LEAST_SAMPLES:
        return ""
    return (
        f"{count} samples lie within {radius:.3g} of the contact, where the contours are smooth; a "
        f"patch needs {_LEAST_SAMPLES}: sample more finely there"
    )


def is_from_outside(state: AtlasState, touch: Touch, contours) -> bool:
    """Whether contours without a patch face the approach: each as the known surface does, or
    steeply where too little of it is known. Where nothing is known they tell nothing."""
    return state.body is not None and all(_faces_approach(state, touch, c) for c in contours)


def _faces_approach(state: AtlasState, touch: Touch, contour: Contour) -> bool:
    """Whether one contour does: see ``is_from_outside``."""
    side = _known_side(state, touch.approach, (contour,))
    return side > 0 or (side == 0 and _facing(contour, touch) >= _STEEP)


def _facing(contour: Contour, touch: Touch) -> float:
    """Cosine between an approach and the normal of a contour within its plane, at the contact."""
    offset = contour.points - touch.contact
    contact = (offset * offset).sum(axis=1).argmin()
    return float(contour_normals(contour, touch.approach)[contact] @ touch.approach)


def _known_side(state: AtlasState, outward, contours) -> int:
    """1 where the known surface faces as contours do that are turned ``outward`` (3,) at their
    contact, -1 where it faces the other way, and 0 where too little is known. Each sample on the
    known surface counts by how sure that is: about the contact it may be a guess."""
    if state.body is None:
        return 0
    points = np.concatenate([contour.points for contour in contours])
    normals = np.concatenate([contour_normals(c, outward) for c in contours])
    found, known = state.body.at(points)
    variance, own = found.deviation**2, state.sample_std**2
    on = known & (found.distance**2 <= _SURE**2 * (variance + own))
    cosine = (found.normal * normals).sum(axis=1)
    weight = np.where(on & (np.abs(cosine) >= _GRAZING), own / (own + variance), 0.0)
    says, most = float(weight @ np.sign(cosine)), float(weight.sum())
    return int(np.sign(says)) if most >= _LEAST_SAYS and abs(says) >= _AGREES * most else 0


def _fit(state: AtlasState, touch: Touch, contours) -> PatchFit:
    """The patch of one touch alone, from those of its contours that are long enough.

    Raises
    ------
    UnfitError
        When no patch fits the contours.
    """
    arcs = [near_arc(c, touch.contact) for c in contours]
    return fit_patch(
        touch.contact,
        tuple(arc for arc in arcs if _has_direction(arc, touch.contact)),
        touch.approach,
        bias=state.bias,
        detail=state.bias,
        radius_floor=_LEAST_RADIUS * state.scale,
        options=FitOptions(adaptive=False),
    )


def _has_direction(contour: Contour, contact) -> bool:
    """Whether a contour goes farther from the contact than its noise explains. In the corner of a
    face it may not."""
    return not _in_ball(contour.points, contact, _LEAST_LENGTH * contour.noise_std).all()


def _in_ball(points, centre, radius: float) -> np.ndarray:
    """(n,) whether points (n, 3) lie within a radius of a centre (3,)."""
    offset = points - centre
    return np.asarray((offset * offset).sum(axis=1) <= radius**2)
