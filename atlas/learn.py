"""Learn: the samples of a touch are checked, oriented and entered."""

from dataclasses import replace

import numpy as np

from touchatlas.atlas.body.other_unit import unit_factor
from touchatlas.atlas.pieces.piece import Piece, in_plane_cosines
from touchatlas.atlas.records.options import SCALE_NOISE
from touchatlas.atlas.records.touch import LEAST_POINTS, AtlasChange, Touch, TouchStatus, extent_of
from touchatlas.atlas.samples.corrected import without_bad
from touchatlas.atlas.samples.crossings import crossings_of
from touchatlas.atlas.samples.predictive_law import innovations_of
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.atlas.state import AtlasState
from touchatlas.atlas.touch_side import (
    near_arc,
    noise_hides,
    outer_side,
    quadric_of_touch,
    stds_of,
    too_few,
)
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.patch.geometry.normal_error import MOST_TILT
from touchatlas.patch.geometry.section import contour_normals


def learn(state: AtlasState, touch: Touch, is_late: bool = True) -> AtlasChange:
    """Enter the samples of one touch and the way on which the probe came, or say why the samples
    are refused. Without contact only the way is entered. What a touch shows of the surface before
    it counts where it is late."""
    contours, bad = check_touch(state, touch)
    if touch.status is not TouchStatus.TOUCHED:
        _enter_way(state, touch)
        return AtlasChange(refused=f"the probe reported: {touch.status.value}")
    if not contours:
        return AtlasChange(refused=too_few(0))
    evidence = state.evidence.and_of(touch.number, contours, touch.contact, len(bad))
    contours = evidence.corrected(contours, touch.contact)
    points = np.concatenate([c.points for c in contours])
    if learned_before(state.pool, contours):
        return AtlasChange(
            refused=f"a contour of touch {touch.number} was learned before, point for point; give "
            "each once, because a repeated contour holds no new measurement"
        )
    settle_scale(state, [contour.noise_std for contour in contours])
    quadric = quadric_of_touch(state, touch, contours)
    outward, reason = outer_side(state, touch, contours, quadric)
    if outward is None:
        hidden = quadric is None and noise_hides(touch, contours)
        return AtlasChange(refused=reason, hidden=hidden)
    numbers = np.repeat(np.arange(len(contours)), [len(c.points) for c in contours])
    noise = np.array([c.noise_std for c in contours])[numbers]
    normals = _normals(state, touch.contact, contours, outward, quadric)
    news, first = innovations(state, points, noise, is_late), len(state.pool)
    settle_tip(state, touch.tip_radius, touch.systematic_std)
    enter_samples(state, contours, normals, noise, numbers, touch.number)
    _enter_way(state, touch)
    found = evidence.crossings + crossings_of(state.pool, first, state.levels)
    state.evidence = replace(evidence, crossings=found)
    state.bad_contacts = np.concatenate([state.bad_contacts, bad])
    return AtlasChange(innovations=news)


def check_touch(state: AtlasState, touch: Touch) -> tuple[tuple[Contour, ...], np.ndarray]:
    """The contours of a touch that have points enough, without bad contacts, and these (k, 3).
    What is no touch, or one of another tip, or in another unit than what was measured so far, is
    refused.

    Raises
    ------
    ValueError
        See ``check_tip``, ``check_noise`` and ``check_unit_of_length``.
    """
    if not isinstance(touch, Touch):
        raise ValueError(f"got {type(touch).__name__}; give a Touch, as a probe returns it")
    if touch.status is TouchStatus.TOUCHED:
        check_tip(state, f"touch {touch.number}", touch.tip_radius)
    good, bad = without_bad(touch.contours)
    contours = tuple(c for c in good if len(c.points) >= LEAST_POINTS)
    check_noise(state, f"touch {touch.number}", [contour.noise_std for contour in contours])
    # The first three touches are small.
    if contours and state.touches >= 3:
        points = np.concatenate([contour.points for contour in contours])
        name, stds = f"touch {touch.number}", stds_of(state, contours)
        check_unit_of_length(state, name, points, stds, touch.approach)
    return contours, bad


def check_noise(state: AtlasState, name: str, noise) -> None:
    """Refuse samples without any error, stated in noise (n,), length, or borne.

    Raises
    ------
    ValueError
        When some state no noise, and the atlas bears no lack of fit.
    """
    if not state.options.bias > 0.0 and np.min(noise, initial=np.inf) == 0.0:
        raise ValueError(
            f"{name} states a noise of 0, and AtlasOptions(bias=0) bears no lack of fit; state a "
            "noise_std > 0, or leave the bias at its default"
        )


def check_tip(state: AtlasState, name: str, radius: float) -> None:
    """Refuse what has a tip of another radius, length, than what was measured so far.

    Raises
    ------
    ValueError
        When one atlas would learn centres of two tips, or centres and contacts.
    """
    if len(state.pool) and radius != state.tip_radius:
        raise ValueError(
            f"{name} has a tip radius of {radius:.6g}, but what was measured so far one of "
            f"{state.tip_radius:.6g}; give all as centres of one tip, or as contacts, with 0"
        )


def settle_tip(state: AtlasState, radius: float, systematic_std: float) -> None:
    """Take the radius of the tip, length, and the deviation of what all samples are off together,
    length, the largest of all."""
    state.pool.tip_radius = float(radius)
    if systematic_std > state.systematic_std:
        state.systematic_std = float(systematic_std)
        state.forget_law()


def check_unit_of_length(state: AtlasState, name: str, points, stds, outward) -> None:
    """Refuse points (n, 3) of standard deviations (n,) in another unit than what was measured so
    far; ``name`` is what they are, and ``outward`` (n, 3) or (3,) the free side, zero where it is
    not known.

    Raises
    ------
    ValueError
        When they extend 300 times less or more: in metres among millimetres it is 1000 times. Or
        when they lie on the known surface in another unit only.
    """
    if not len(state.pool) or len(points) < LEAST_POINTS:
        return
    size, seen = extent_of(points), extent_of(state.pool.points)
    if not seen <= 300.0 * size <= 300.0**2 * seen:
        raise ValueError(
            f"{name} measures {size:.3g}, but what was measured so far {seen:.3g}; give all in the "
            "same unit"
        )
    if state.body is None:
        return
    if factor := unit_factor(state.body, points, stds, outward, state.levels.sure):
        way = f"multiplied by {factor:g}" if factor > 1.0 else f"divided by {1.0 / factor:g}"
        raise ValueError(
            f"{name} lies on the known surface where its lengths are {way}, and nowhere as it is; "
            "give all in the same unit"
        )


def learned_before(pool: SamplePool, contours: tuple[Contour, ...]) -> bool:
    """Whether the points of any contour are samples already, bit for bit.

    Noise repeats no point, so equal points are the same measurement. The pool keeps the samples of
    a contour in order, so its first point tells where the others must be.
    """
    for path in (contour.learned_points(pool.tip_radius) for contour in contours):
        for start in np.flatnonzero(pool.points[:, 0] == path[0, 0]).tolist():
            if np.array_equal(pool.points[start : start + len(path)], path):
                return True
    return False


def settle_scale(state: AtlasState, noise, most: float = np.inf) -> None:
    """Take the scale, ``most`` of them, from the standard deviations (k,) of the noise of the first
    contours, length, where none was given. Without noise it stays the tolerance."""
    if not (state.scale_is_given or len(state.pool)) and np.max(noise) > 0.0:
        state.scale = min(SCALE_NOISE * float(np.median(noise)), most)


def _normals(
    state: AtlasState, contact, contours, outward, quadric: Piece | None
) -> list[np.ndarray]:
    """Outward normals (k, 3) at the points of each contour: measured ones, else those of the
    contour in its plane, and of the quadric on near arcs where it is known how that leans across
    the plane."""
    found = [contour_normals(contour, outward) for contour in contours]
    if quadric is None:
        return found
    for contour, normals in zip(contours, found, strict=True):
        if contour.normals is not None:
            continue
        arc = near_arc(contour, contact)
        own = quadric.at(contour.points[arc])[1]
        across = np.tile(contour.plane.normal, (len(arc), 1))
        cosine = in_plane_cosines(own, normals[arc], across)
        own *= np.sign(cosine)[:, None]
        faces = np.abs(cosine) >= state.levels.facing
        faces &= quadric.slope_variance(contour.points[arc], across) <= MOST_TILT**2
        normals[arc[faces]] = own[faces]
    return found


def innovations(state: AtlasState, points, noise, is_late: bool = True) -> np.ndarray:
    """(k, 6) what new samples (n, 3), of noise (n,), show of the surface that was predicted
    before them: see ``innovations_of``. Where nothing was known, or as little as of a polynomial
    far from all samples, they show nothing, and where they are not late, nobody asks."""
    if is_late:
        state.catch_up()
    if state.body is None or not is_late:
        return np.zeros((0, 6))
    noise = np.broadcast_to(np.asarray(noise, float), len(points))
    found, known = state.body.at(points)
    known &= found.deviation <= state.levels.sure * max(state.scale, state.sample_std)
    std, away = np.hypot(noise, state.bias), state.body.away(points)
    columns = found.distance, found.deviation, noise, std, away
    return innovations_of(len(state.pool), *columns)[known]


def enter_samples(
    state: AtlasState, contours: tuple[Contour, ...], normals, noise, numbers, touch: int
) -> None:
    """Add the samples of contours of the touch of a number, with the normals (k, 3) of each, their
    noise (n,), length, and the number (n,) of its contour, to the pool, and the ends at which
    contact was lost to the rims."""
    points = np.concatenate([c.learned_points(state.tip_radius) for c in contours])
    across = np.array([c.plane.normal for c in contours])[numbers]
    edges = np.concatenate([_is_at_edge(c) for c in contours])
    measured = np.array([c.normals is not None for c in contours])[numbers]
    state.rims.ends.extend(contours, normals)
    columns = points, np.concatenate(normals), across, edges, noise, numbers, measured, touch
    state.pool.add(*columns)


def _is_at_edge(contour: Contour) -> np.ndarray:
    """(n,) whether each point of a contour is the last one before an edge."""
    out = np.zeros(len(contour.points), bool)
    out[0], out[-1] = (end is ContourEnd.EDGE for end in contour.ends)
    return out


def _enter_way(state: AtlasState, touch: Touch) -> None:
    """Enter the way through air on which the probe came, if it is known."""
    if touch.way is not None:
        state.ways = np.concatenate([state.ways, touch.way[None]])
