"""Learn: the samples of a touch are checked, oriented and entered."""

import numpy as np

from touchatlas.atlas.body.other_unit import unit_factor
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.piece import Piece, in_plane_cosines
from touchatlas.atlas.records.touch import LEAST_POINTS, AtlasChange, Touch, TouchStatus, extent_of
from touchatlas.atlas.samples.evidence import Shift, shift_of, without_bad
from touchatlas.atlas.samples.predictive_law import innovations_of
from touchatlas.atlas.samples.sample_pool import SamplePool
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.contour import Contour, ContourEnd
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.patch.geometry.kinks import kinks
from touchatlas.patch.geometry.normal_error import MOST_TILT
from touchatlas.patch.geometry.order import disorder, far_points
from touchatlas.patch.geometry.section import MOST_TURN, contour_normals

# Unit of the fits in standard deviations of the noise, where no other is given.
SCALE_NOISE = 5.0


def learn(state: AtlasState, touch: Touch) -> AtlasChange:
    """Enter the samples of one touch and the way on which the probe came, or say why the samples
    are refused. Without contact only the way is entered."""
    check_touch(state, touch)
    if touch.status is not TouchStatus.TOUCHED:
        _enter_way(state, touch)
        return AtlasChange(refused=f"the probe reported: {touch.status.value}")
    contours, bad = _good_contours(touch)
    if not contours:
        return AtlasChange(refused=_too_few(0))
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
    counts = [len(c.points) for c in contours]
    noise = np.repeat([c.noise_std for c in contours], counts)
    normals = _normals(state, touch.contact, contours, outward, quadric)
    numbers = np.repeat(np.arange(len(contours)), counts)
    news, shift = compared(state, points, noise, np.concatenate(normals), numbers)
    settle_tip(state, touch.tip_radius, touch.systematic_std)
    enter_samples(state, contours, normals)
    _enter_way(state, touch)
    state.evidence = evidence.with_shift(shift)
    state.bad_contacts = np.concatenate([state.bad_contacts, bad])
    return AtlasChange(innovations=news)


def check_touch(state: AtlasState, touch: Touch) -> None:
    """Refuse what is no touch, or one of another tip, or in another unit than what was measured so
    far.

    Raises
    ------
    ValueError
        See ``check_tip``, ``check_noise`` and ``check_unit_of_length``.
    """
    if not isinstance(touch, Touch):
        raise ValueError(f"got {type(touch).__name__}; give a Touch, as a probe returns it")
    if touch.status is TouchStatus.TOUCHED:
        check_tip(state, f"touch {touch.number}", touch.tip_radius)
    contours, _ = _good_contours(touch)
    check_noise(state, f"touch {touch.number}", [contour.noise_std for contour in contours])
    # The first three touches are small.
    if contours and state.touches >= 3:
        points = np.concatenate([contour.points for contour in contours])
        name, stds = f"touch {touch.number}", stds_of(state, contours)
        check_unit_of_length(state, name, points, stds, touch.approach)


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


def _good_contours(touch: Touch) -> tuple[tuple[Contour, ...], np.ndarray]:
    """The contours of a touch that have points enough, without bad contacts, and these (k, 3)."""
    contours, bad = without_bad(touch.contours)
    return tuple(c for c in contours if len(c.points) >= LEAST_POINTS), bad


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
        return _too_few(len(contours))
    noise = max(contour.noise_std for contour in contours)
    length = max(extent_of(contour.points) for contour in contours)
    return (
        f"noise of {noise:.3g} hides the normal of the surface from contours of {length:.3g}: "
        "track longer ones, in more planes, or sample more finely"
    )


def _too_few(count: int) -> str:
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


def innovations(state: AtlasState, points, noise) -> np.ndarray:
    """(k, 6) what new samples (n, 3), of noise (n,), show of the surface that was predicted
    before them: see ``innovations_of``. Where nothing was known, or as little as of a polynomial
    far from all samples, they show nothing."""
    return compared(state, points, noise)[0]


def compared(
    state: AtlasState, points, noise, normals=None, numbers=None
) -> tuple[np.ndarray, Shift]:
    """The ``innovations`` of new samples, and what those with normals (n, 3), of contours
    ``numbers`` (n,), say of a shift of the object: those within a step of others, where the surface
    faces as they do. Farther away it may have features that no sample met, and where it is turned
    an edge lies between. A surface that is farther from a sample than the others are does not
    follow those, and one that leaves the nearest of them says nothing."""
    if state.body is None:
        return np.zeros((0, 6)), Shift()
    noise = np.broadcast_to(np.asarray(noise, float), len(points))
    found, known = state.body.at(points)
    known &= found.deviation <= state.levels.sure * max(state.scale, state.sample_std)
    std, away = np.hypot(noise, state.bias), state.body.away(points)
    columns = found.distance, found.deviation, noise, std, away
    news = innovations_of(state.next_number, *columns)[known]
    if normals is None or len(points) < 2:
        return news, Shift()
    step = np.median(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)))
    sure = known & (found.deviation <= state.sample_std) & (away <= step)
    sure &= (found.normal * normals).sum(axis=1) > state.levels.facing
    sure &= np.abs(found.distance) <= away + state.levels.sure * std
    sure[sure] = state.body.follows(points[sure])
    square = state.law.scale(found.deviation[sure]) ** 2 + noise[sure] ** 2
    own = found.distance[sure], found.normal[sure], square
    of = None if numbers is None else numbers[sure]
    return news, shift_of(*own, state.law.freedom, state.levels, of)


def enter_samples(state: AtlasState, contours: tuple[Contour, ...], normals) -> None:
    """Add the samples of contours, with the normals (k, 3) of each, to the pool, and the ends at
    which contact was lost to the rims."""
    points = np.concatenate([c.learned_points(state.tip_radius) for c in contours])
    across = np.concatenate([np.tile(c.plane.normal, (len(c.points), 1)) for c in contours])
    edges = np.concatenate([_is_at_edge(c) for c in contours])
    counts = [len(c.points) for c in contours]
    noise = np.repeat([c.noise_std for c in contours], counts)
    numbers = np.repeat(np.arange(len(contours)), counts)
    state.rims.ends.extend(contours, normals)
    measured = np.repeat([c.normals is not None for c in contours], counts)
    state.pool.add(points, np.concatenate(normals), across, edges, noise, numbers, measured)


def _is_at_edge(contour: Contour) -> np.ndarray:
    """(n,) whether each point of a contour is the last one before an edge."""
    out = np.zeros(len(contour.points), bool)
    out[0], out[-1] = (end is ContourEnd.EDGE for end in contour.ends)
    return out


def _enter_way(state: AtlasState, touch: Touch) -> None:
    """Enter the way through air on which the probe came, if it is known."""
    if touch.way is not None:
        state.ways = np.concatenate([state.ways, touch.way[None]])
