"""Contours on the surface of an implicit function: curves in planes, also over sharp edges."""

import numpy as np

from touchatlas.patch import ContourEnd
from touchatlas.patch.geometry.arrays import cross
from touchatlas.sim.world.finer_steps import finer_steps
from touchatlas.sim.world.implicit_fields import Field


def trace_arms(
    field: Field, point, plane_normals, directions, reach, step, max_turn, step_turn=np.pi
):
    """Curves from a surface point in several planes, all advanced step by step together: see
    ``ImplicitObject.trace_arms``."""
    normals = np.array(plane_normals)
    first = _tangents(field, np.broadcast_to(point, normals.shape), normals)
    normals = np.where(((first * directions).sum(axis=1) < 0.0)[:, None], -normals, normals)
    first = _tangents(field, np.broadcast_to(point, normals.shape), normals)
    x, paths = np.broadcast_to(point, normals.shape).copy(), []
    ends = [ContourEnd.LENGTH_REACHED] * len(normals)
    counts = np.zeros(len(normals), int)
    active = np.ones(len(normals), bool)
    for number in range(int(reach / step + 1e-9)):
        ahead = x.copy()
        ahead[active] = _step(field, x[active], normals[active], step)
        tangents = _tangents(field, ahead, normals)
        cosine = (tangents * first).sum(axis=1)
        offset = ahead - point
        home = (number > 2) & ((offset * offset).sum(axis=1) < (0.5 * step) ** 2)
        for arm in np.flatnonzero(
            active & ((cosine < np.cos(min(max_turn, np.pi)) - 1e-12) | home)
        ):
            active[arm] = False
            ends[arm] = (
                ContourEnd.CLOSED_LOOP
                if home[arm]
                else _end_ahead(field, x[arm], normals[arm], step, max_turn)
            )
        counts += active
        x = np.where(active[:, None], ahead, x)
        paths.append(x)
        if not active.any():
            break
    path = np.array(paths).reshape(len(paths), len(normals), 3)
    arms = [path[: counts[arm], arm] for arm in range(len(normals))]
    return [
        (_finer(field, point, arm, normal, step, step_turn), end)
        for arm, normal, end in zip(arms, normals, ends, strict=True)
    ]


def _finer(field: Field, point, arm, normal, step, step_turn) -> np.ndarray:
    """An arm (k, 3) with the points between those that it turns much."""
    arm = np.vstack([point[None], arm])

    def between(at) -> np.ndarray:
        whole = at.astype(int)
        planes = np.broadcast_to(normal, (len(at), 3))
        steps = step * (at - whole)
        ahead = _advance(field, arm[whole], planes, steps[:, None])
        far = _is_far(arm[whole], ahead, steps) | _is_far(ahead, arm[whole + 1], step - steps)
        for k in np.flatnonzero(far):
            ahead[k] = _step_over_edges(field, arm[whole[[k]]], planes[[k]], float(steps[k]))
        return ahead

    at = finer_steps(arm, step_turn, between)[1:]
    whole = at == np.round(at)
    points = np.empty((len(at), 3))
    points[whole], points[~whole] = arm[1:], between(at[~whole])
    return points


def _step(field: Field, x, normals, step) -> np.ndarray:
    """(m, 3) points one step of arc length from points x (m, 3) along each curve, also over
    edges."""
    ahead = _advance(field, x, normals, step)
    breaks = _breaks(x, ahead, normals_at(field, x), normals_at(field, ahead), step)
    for arm in np.flatnonzero(breaks):
        ahead[arm] = _step_over_edges(field, x[[arm]], normals[[arm]], step)
    return ahead


def _step_over_edges(field: Field, x, normal, step) -> np.ndarray:
    """(3,) point one step of arc length from x (1, 3) along a curve: up to each edge in shorter
    and shorter steps, and across it in two of the shortest."""
    # An edge is known to lie within ``most`` ahead: longer steps need not be tried.
    left, shortest, most = step, step / 256.0, np.inf
    while left > shortest:
        way = left
        while way > max(most, shortest):
            way *= 0.5
        ahead = _advance(field, x, normal, way)
        while _breaks(x, ahead, normals_at(field, x), normals_at(field, ahead), way)[0]:
            if way <= shortest:
                ahead, way = _across(field, x, normal, 2.0 * shortest)
                most = np.inf
                break
            most, way = way, 0.5 * way
            ahead = _advance(field, x, normal, way)
        x, left, most = ahead, left - way, most - way
    return np.asarray(x[0])


def _across(field: Field, x, normal, way) -> tuple[np.ndarray, float]:
    """A point (1, 3) across an edge, and how far ahead of x (1, 3) it is: at least ``way``, and as
    much more as it takes until Newton's method ends there. A face that is nearly parallel to the
    plane of the curve may lead it to another face."""
    # Each step is twice as long as the one before; the last is half a step.
    for longer in way * 2.0 ** np.arange(7):
        ahead = _advance(field, x, normal, longer)
        if not _is_far(x, ahead, longer)[0]:
            return ahead, float(longer)
    return x.copy(), way


def _end_ahead(field: Field, x, normal, step, max_turn) -> ContourEnd:
    """EDGE where the tangent ahead of x turns too much at a point, TURNED_AWAY where it turns
    too much in all, or may turn by a right angle."""
    if max_turn >= 0.5 * np.pi:
        return ContourEnd.TURNED_AWAY
    x, normal = x[None], normal[None]
    for _ in range(8):
        step *= 0.5
        ahead = _advance(field, x, normal, step)
        if not _breaks(x, ahead, normals_at(field, x), normals_at(field, ahead), step)[0]:
            x = ahead
    ahead = _advance(field, x, normal, 2.0 * step)
    breaks = _breaks(x, ahead, normals_at(field, x), normals_at(field, ahead), 2.0 * step)[0]
    cosine = float(_tangents(field, x, normal)[0] @ _tangents(field, ahead, normal)[0])
    jumps = breaks and cosine < np.cos(max_turn)
    return ContourEnd.EDGE if jumps else ContourEnd.TURNED_AWAY


def _tangents(field: Field, x, normals) -> np.ndarray:
    """Unit tangents (m, 3) of the curve through each x in each plane; zero where a face is parallel
    to the plane, so that it has no curve."""
    tangents = cross(field.first_order(x)[1], normals)
    length = np.sqrt((tangents**2).sum(axis=1))
    return tangents / np.where(length > 0.0, length, 1.0)[:, None]


def _advance(field: Field, x, normals, step) -> np.ndarray:
    """One step of arc length, or one of each of (m, 1), along each curve: Runge-Kutta, then
    Newton in the plane."""
    a = _tangents(field, x, normals)
    b = _tangents(field, x + 0.5 * step * a, normals)
    c = _tangents(field, x + 0.5 * step * b, normals)
    d = _tangents(field, x + step * c, normals)
    ahead = x + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    for _ in range(3):
        value, gradient = field.first_order(ahead)
        gradient = gradient - (gradient * normals).sum(axis=1)[:, None] * normals
        square = (gradient**2).sum(axis=1)
        ahead = ahead - (value / np.where(square > 0.0, square, np.inf))[:, None] * gradient
    return ahead


def normals_at(field: Field, points) -> np.ndarray:
    """(n, 3) outward unit normals at surface points."""
    gradient = field.first_order(points)[1]
    return gradient / np.sqrt((gradient**2).sum(axis=1))[:, None]


def _breaks(x, ahead, before, after, step) -> np.ndarray:
    """(m,) whether steps from points x (m, 3) with normals ``before`` left their smooth face: the
    normal turned at an edge, or the step is too long."""
    # A normal that turns by 15 degrees within 1/256 of a step turns at an edge.
    turned = (before * after).sum(axis=1) < np.cos(np.deg2rad(15.0))
    return np.asarray(turned | _is_far(x, ahead, step))


def _is_far(x, ahead, step) -> np.ndarray:
    """(m,) whether steps from points x (m, 3) are too long."""
    chord = ahead - x
    # A chord is never longer than its arc; but beyond an edge a face may be nearly perpendicular to
    # the plane of the curve, and Newton's method ends anywhere on it.
    return np.asarray((chord * chord).sum(axis=1) > (1.5 * step) ** 2)
