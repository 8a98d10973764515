"""The outer side of a touch: a quadric of its near arcs, the approach, and the known surface."""

import numpy as np

from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece, in_plane_cosines
from touchatlas.atlas.records.touch import LEAST_POINTS, Touch, extent_of
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.patch.geometry.kinks import kinks
from touchatlas.patch.geometry.normal_error import MOST_TILT
from touchatlas.patch.geometry.order import disorder, far_points
from touchatlas.patch.geometry.section import MOST_TURN, contour_normals


def quadric_of_touch(state: AtlasState, touch: Touch, contours) -> Piece | None:
    """The quadric that fits the near arcs of a touch, its normal at the contact toward the
    approach; None where they leave that normal open: they are too few, too short or in parallel
    planes."""
    arcs = [near_arc(contour, touch.contact) for contour in contours]
    points = np.concatenate([c.points[arc] for c, arc in zip(contours, arcs, strict=True)])
    normals = np.concatenate(
        [contour_normals(c, touch.approach)[arc] for c, arc in zip(contours, arcs, strict=True)]
    )
    noise = max(contour.noise_std for contour in contours)
    std = float(np.hypot(noise, state.bias)) or 1e-6 * extent_of(points)
    if len(points) < Kind.QUADRIC.parameters or not std > 0.0:
        return None
    quadric = fit_piece(Kind.QUADRIC, points, normals, std)
    if quadric is None:
        return None
    [normal] = quadric.at(touch.contact[None])[1]
    first = any_tangent(normal)
    across = np.stack([first, np.cross(normal, first)])
    tilt = quadric.slope_variance(np.tile(touch.contact, (2, 1)), across)
    return quadric if tilt.max() <= MOST_TILT**2 else None


def outer_side(
    state: AtlasState, touch: Touch, contours, quadric: Piece | None
) -> tuple[np.ndarray | None, str]:
    """The outward normal (3,) at the contact, as far as contours need it to be turned; None where
    the side is not known, and why.

    Measured normals tell the side, else the approach where it is steep, and so does the known
    surface about the contours. Without a quadric each contour needs one of these.
    """
    if (measured := _measured_normal(touch.contact, contours)) is not None:
        return measured, ""
    # Across an edge a quadric follows no contour.
    if quadric is None or not _follows(quadric, touch, contours, state.levels.facing):
        known = state.body is not None and all(_faces_approach(state, touch, c) for c in contours)
        if known:
            return touch.approach, ""
    if quadric is None:
        return None, _unseen(touch, contours)
    [normal] = quadric.at(touch.contact[None])[1]
    facing = normal @ touch.approach
    if facing < 0.0:
        normal, facing = -normal, -facing
    side = 0 if facing >= state.levels.facing else _known_side(state, normal, contours)
    # Within 15 degrees of the tangent plane the normal may be turned inside out by its error.
    if side == 0 and facing < np.sin(MOST_TILT):
        return None, _grazing(contours)
    return (-normal if side < 0 else normal), ""


def _follows(quadric: Piece, touch: Touch, contours, facing: float) -> bool:
    """Whether the normal of a quadric at the contact is on the side, by the least cosine of normals
    that face the same one, of those that contours show there in their planes."""
    [normal] = quadric.at(touch.contact[None])[1]
    shown = np.array([_at_contact(contour, touch.contact, normal) for contour in contours])
    planes = np.array([contour.plane.normal for contour in contours])
    cosines = in_plane_cosines(np.tile(normal, (len(shown), 1)), shown, planes)
    return not ((cosines != 0.0) & (cosines < facing)).any()


def _at_contact(contour: Contour, contact, outward) -> np.ndarray:
    """The normal (3,) of a contour toward ``outward`` (3,) where it is nearest to the contact."""
    nearest = ((contour.points - contact) ** 2).sum(axis=1).argmin()
    return np.asarray(contour_normals(contour, outward)[nearest])


def _measured_normal(contact, contours) -> np.ndarray | None:
    """Mean of the normals (3,) that were measured next to the contact, one of each contour; None
    where there are none."""
    near = [
        contour.normals[((contour.points - contact) ** 2).sum(axis=1).argmin()]
        for contour in contours
        if contour.normals is not None
    ]
    return np.mean(near, axis=0) if near else None


def noise_hides(touch: Touch, contours) -> bool:
    """Whether contours in planes that are not parallel have points enough for a quadric about the
    contact, so that only their noise leaves the normal open."""
    across = np.array([contour.plane.normal for contour in contours])
    spread = np.linalg.svd(across, compute_uv=False)[1:]
    count = sum(len(near_arc(contour, touch.contact)) for contour in contours)
    return bool((spread > np.sin(MOST_TILT)).any()) and count >= Kind.QUADRIC.parameters


def _unseen(touch: Touch, contours) -> str:
    """Why contours that are long enough leave the normal open."""
    if not noise_hides(touch, contours):
        return too_few(len(contours))
    noise = max(contour.noise_std for contour in contours)
    length = max(extent_of(contour.points) for contour in contours)
    return (
        f"noise of {noise:.3g} hides the normal of the surface from contours of {length:.3g}: "
        "track longer ones, in more planes, or sample more finely"
    )


def too_few(count: int) -> str:
    """That so many contours with points enough leave the normal open."""
    return (
        f"contours of {LEAST_POINTS} points or more: {count}; they do not show the normal of the "
        "surface: track more planes, longer contours, or sample more finely"
        + ("; a Scan takes a single curve and what tells its outer side" if count == 1 else "")
    )


def _grazing(contours) -> str:
    """Why the normal lies across the approach: a bad contact turns it, or the probe grazed."""
    for place, contour in enumerate(contours):
        if far_points(contour.points).any():
            return f"contour {place} {disorder(contour.points)}"
    return (
        "the probe came nearly along the surface, or one of few points is a bad contact, so that "
        "the outer side is not known; come along the normal, or sample more finely"
    )


def _faces_approach(state: AtlasState, touch: Touch, contour: Contour) -> bool:
    """Whether one contour faces the approach as the known surface does, or steeply where too
    little of that is known."""
    if side := _known_side(state, touch.approach, (contour,)):
        return side > 0
    normal = _at_contact(contour, touch.contact, touch.approach)
    return bool(normal @ touch.approach >= state.levels.facing)


def _known_side(state: AtlasState, outward, contours) -> int:
    """1 where the known surface faces as contours do that are turned ``outward`` (3,) at their
    contact, -1 where it faces the other way, and 0 where too little is known: less than half a
    sample, or a quarter of the samples, more on one side than on the other. Each sample on the
    known surface counts by how sure that is: about the contact it may be a guess."""
    state.catch_up()
    if state.body is None:
        return 0
    points = np.concatenate([contour.points for contour in contours])
    normals = np.concatenate([contour_normals(c, outward) for c in contours])
    found, known = state.body.at(points)
    variance, own = found.deviation**2, stds_of(state, contours) ** 2
    on = known & (found.distance**2 <= state.levels.sure**2 * (variance + own))
    cosine = (found.normal * normals).sum(axis=1)
    weight = np.where(on & (np.abs(cosine) >= np.sin(MOST_TILT)), own / (own + variance), 0.0)
    says = float(weight @ np.sign(cosine))
    return int(np.sign(says)) if abs(says) >= 0.5 * max(weight.sum(), 1.0) else 0


def stds_of(state: AtlasState, contours) -> np.ndarray:
    """(n,) standard deviations of the distances of the points of contours from the surface,
    length."""
    counts, noise = [len(c.points) for c in contours], [c.noise_std for c in contours]
    return np.repeat(np.hypot(noise, state.bias), counts)


def near_arc(contour: Contour, contact) -> np.ndarray:
    """(k,) indices of the points of a contour around the contact, in order of travel, up to a sharp
    edge or until it has turned by ``MOST_TURN`` either way. A closed contour is opened opposite
    the contact."""
    index = np.arange(len(contour.points))
    at = int(((contour.points - contact) ** 2).sum(axis=1).argmin())
    if ContourEnd.CLOSED_LOOP in contour.ends:
        half = len(index) // 2
        index, at = np.roll(index, half - at), half
    points = contour.points[index]
    sharp = kinks(points, contour.plane.normal, contour.noise_std)
    first = max(sharp[sharp < at], default=-1) + 1
    last = min(sharp[sharp > at], default=len(points))
    ahead, behind = _before_turn(points[at:last]), _before_turn(points[first : at + 1][::-1])
    return np.asarray(index[at + 1 - behind : at + ahead])


def _before_turn(points) -> int:
    """Number of points of an arm (n, 3) before it has turned by ``MOST_TURN``; its direction is
    that of two chords, which halves the noise of one."""
    chords = np.diff(points, axis=0)
    if len(chords) <= 2:
        return len(points)
    runs = chords[1:] + chords[:-1]
    first = runs[0]
    length = np.sqrt(np.einsum("ij,ij->i", runs, runs) * (first @ first))
    turned = np.flatnonzero(runs @ first < np.cos(MOST_TURN) * length)
    return len(points) if not len(turned) else max(2, int(turned[0])) + 1
