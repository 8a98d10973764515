"""Families of shapes: umbilics, parabolic points, saddles, edges, folds, detail."""

from dataclasses import replace

import numpy as np

from touchatlas.sim.study.scenes import draw_scene
from touchatlas.sim.study.stability.case import Case, Shape, Track, Truth
from touchatlas.sim.study.stability.family import Family, anywhere, even_plan
from touchatlas.sim.study.stability.surfaces import (
    Height,
    crease,
    graph_truth,
    quadric,
    total,
    wavy,
)
from touchatlas.sim.study.stability.tracking import NOISE, placed, touch_ball, touch_graph

# Curvature of the surfaces where it is not the severity, over the reach.
_BEND = 0.4
# Points of a curve on the torus, and its tube radius (mm).
_TUBE, _NORMAL_TILT = 15.0, np.pi / 18.0


def _turn(rng) -> float:
    return float(rng.uniform(0.0, np.pi))


def umbilic(difference: float, rng) -> Case:
    """Both curvatures nearly equal."""
    k1, k2 = -_BEND + 0.5 * difference, -_BEND - 0.5 * difference
    return anywhere(quadric(k1, k2, _turn(rng)), rng)


def parabolic(second: float, rng) -> Case:
    """One curvature nearly zero."""
    return anywhere(quadric(second, -_BEND, _turn(rng)), rng)


def plane(bend: float, rng) -> Case:
    """Nearly a plane."""
    return anywhere(quadric(-bend, -bend * rng.uniform(0.0, 1.0), _turn(rng)), rng)


def saddle(bend: float, rng) -> Case:
    """Equal and opposite curvatures."""
    return anywhere(quadric(bend, -bend, _turn(rng)), rng)


def monkey_saddle(size: float, rng) -> Case:
    """z = size (x^3 - 3 x y^2), with K = 0 at the origin."""
    return anywhere(lambda x, y: size * (x**3 - 3.0 * x * y * y), rng)


def changing_sign(size: float, rng) -> Case:
    """K changes its sign across the patch, as on the top of a torus."""
    turn, bend = _turn(rng), quadric(-_BEND, 0.0)
    c, s = np.cos(turn), np.sin(turn)

    def height(x, y):
        u, v = c * x + s * y, c * y - s * x
        return bend(u, v) + size * v**3 / 6.0

    return anywhere(height, rng)


def unseen_cubic(size: float, rng) -> Case:
    """A cubic that vanishes on all three curves: no sample knows of it."""
    plan = even_plan(rng, tilts=(0.0, 0.0, 0.0))
    lines = [(np.cos(a), np.sin(a)) for a in plan.angles]

    def product(x, y):
        return np.prod([c * y - s * x for c, s in lines], axis=0)

    base = wavy(rng, 3.0, _BEND)
    height = total(base, lambda x, y: 4.0 * size * product(x, y))
    return anywhere(height, rng, angles=plan.angles, tilts=plan.tilts)


def torus(reach: float, rng) -> Case:
    """Anywhere on a torus; arms in radii of its tube."""
    return _scene_case("torus", reach * _TUBE, rng)


def fold(arc: float, rng) -> Case:
    """A ball: arms of this arc length over its radius; a height ends at 1.57."""
    plan = even_plan(rng)
    return placed(touch_ball(1.0 / arc, plan, rng), rng)


def crease_distance(distance: float, rng) -> Case:
    """An edge of 60 degrees at this distance; the curves run over it."""
    edge = crease(distance, np.pi / 3.0, rng.uniform(0.0, 2.0 * np.pi))
    return anywhere(total(edge, quadric(-0.1, -0.1)), rng)


def crease_angle(angle: float, rng) -> Case:
    """An edge of this angle (degrees) at 0.4 of the reach."""
    edge = crease(0.4, np.deg2rad(angle), rng.uniform(0.0, 2.0 * np.pi))
    return anywhere(total(edge, quadric(-0.1, -0.1)), rng)


def corner(distance: float, rng) -> Case:
    """Three faces that fall by 45 degrees around a flat one, at this distance."""
    start = rng.uniform(0.0, 2.0 * np.pi)
    edges = [crease(distance, np.pi / 4.0, start + 2.0 * np.pi / 3.0 * i) for i in range(3)]
    return anywhere(total(*edges), rng)


def step(height: float, rng) -> Case:
    """A step of this height (in noise) at 0.4 of the reach, 0.05 wide."""
    turn = rng.uniform(0.0, 2.0 * np.pi)
    c, s = np.cos(turn), np.sin(turn)
    ramp: Height = lambda x, y: (  # noqa: E731
        height * NOISE * 0.5 * (1.0 + np.tanh((c * x + s * y - 0.4) / 0.025))
    )
    return anywhere(total(wavy(rng), ramp), rng)


def texture_height(amplitude: float, rng) -> Case:
    """Waves of 0.15 reach, a little longer than the samples' spacing; amplitude in noise.

    Normal and curvatures are those of the surface without the waves.
    """
    base, waves = wavy(rng), _waves(rng, 0.15, amplitude * NOISE)
    touched = touch_graph(total(base, waves), even_plan(rng), rng)
    truth = Truth(touched.truth.around, graph_truth(base).at)
    return placed(replace(touched, truth=truth), rng)


def texture_length(length: float, rng) -> Case:
    """Waves of ten noises; wavelength in reaches."""
    return anywhere(total(wavy(rng), _waves(rng, length, 10.0 * NOISE)), rng)


def _waves(rng, length: float, amplitude: float) -> Height:
    phases, turn = rng.uniform(0.0, 2.0 * np.pi, 2), _turn(rng)
    c, s, k = np.cos(turn), np.sin(turn), 2.0 * np.pi / length
    return lambda x, y: (
        amplitude
        * (np.sin(k * (c * x + s * y) + phases[0]) * np.sin(k * (c * y - s * x) + phases[1]))
    )


def radius(size: float, rng) -> Case:
    """A smooth surface that is touched too far: reach over its feature length."""
    return anywhere(wavy(rng, 1.0 / size, _BEND), rng)


def smooth_noise_free(bend: float, rng) -> Case:
    """Exact contacts on a smooth surface; curvature over the reach."""
    return anywhere(wavy(rng, 2.0, bend), rng, noise=0.0)


def _scene_case(surface: str, reach: float, rng) -> Case:
    """A touch of an object of ``touchatlas.sim.world``, whose curves may turn by 170 degrees."""
    scene = draw_scene(surface, NOISE * reach, _NORMAL_TILT, rng, turn=3.0, reach=reach)
    verifying = scene.verifying

    def around(point, distance: float):
        square = ((verifying - point) ** 2).sum(axis=1)
        near = square <= distance**2
        return verifying[near] if near.any() else verifying[[square.argmin()]]

    def at(point) -> Shape:
        foot = scene.surface.project(point[None])
        k1, k2, _ = scene.surface.principal_curvatures(foot)
        return Shape(scene.surface.normal(foot)[0], float(k1[0]), float(k2[0]))

    tracks = tuple(
        Track(c.points, c.plane.point, c.plane.normal, c.noise_std) for c in scene.contours
    )
    truth = Truth(around, at)
    return Case(scene.contact, scene.normal, tracks, truth, scene.noise_std, scene.reach)


FAMILIES = {
    "umbilic": Family(
        "(k1 - k2) R",
        (0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 0.8),
        umbilic,
    ),
    "parabolic": Family(
        "k1 R, with k2 R = -0.4", (0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4), parabolic
    ),
    "plane": Family(
        "largest |k| R",
        (0.0, 1e-5, 1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1),
        plane,
    ),
    "saddle": Family(
        "k1 R = -k2 R",
        (0.01, 0.03, 0.1, 0.3, 0.6, 1.0, 1.5, 2.0),
        saddle,
    ),
    "monkey_saddle": Family(
        "size of x^3 - 3 x y^2 over R", (1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.8), monkey_saddle
    ),
    "changing_sign": Family(
        "d^3z/dy^3 R^2", (0.01, 0.03, 0.1, 0.3, 0.6, 1.0, 1.5, 2.0), changing_sign
    ),
    "unseen_cubic": Family(
        "height of the cubic between the curves at R, over R",
        (0.0, 1e-3, 3e-3, 0.01, 0.02, 0.04, 0.08, 0.16),
        unseen_cubic,
    ),
    "torus": Family(
        "arms over the tube's radius",
        (0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.5, 1.8),
        torus,
    ),
    "fold": Family(
        "arc of an arm of a ball, rad",
        (0.2, 0.5, 0.8, 1.1, 1.4, 1.7, 2.0, 2.5),
        fold,
    ),
    "crease_distance": Family(
        "distance of an edge of 60 degrees over R",
        (1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1, 0.05),
        crease_distance,
    ),
    "crease_angle": Family(
        "angle of an edge at 0.4 R, degrees",
        (0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 45.0, 80.0),
        crease_angle,
    ),
    "corner": Family(
        "distance of three edges over R", (1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1, 0.05), corner
    ),
    "step": Family(
        "height of a step at 0.4 R, in noise", (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 200.0), step
    ),
    "texture_height": Family(
        "amplitude of waves of 0.15 R, in noise",
        (0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0),
        texture_height,
    ),
    "texture_length": Family(
        "length of waves of 10 noises over R",
        (4.0, 2.0, 1.0, 0.5, 0.25, 0.12, 0.06, 0.03),
        texture_length,
    ),
    "radius": Family(
        "R over the feature length",
        (0.1, 0.3, 0.5, 0.7, 1.0, 2.0, 4.0, 8.0),
        radius,
    ),
    "exact": Family(
        "curvature times R, contacts without noise",
        (0.01, 0.03, 0.1, 0.2, 0.4, 0.8, 1.2, 1.6),
        smooth_noise_free,
    ),
}
