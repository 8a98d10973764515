"""Families of surfaces: flat, bent, folded, with edges and waves."""

from dataclasses import replace

import numpy as np

from touchatlas.sim.study.cases import (
    Case,
    Plan,
    Track,
    Truth,
    even_plan,
    graph_truth,
    placed,
    touch_graph,
)
from touchatlas.sim.study.family import Family, anywhere, entering, random_turn
from touchatlas.sim.study.heights import Height, Shape, crease, quadric, total, wavy
from touchatlas.sim.study.scenes import draw_scene

SURFACES: dict[str, Family[Case]] = {}
family = entering(SURFACES)


@family("(k1 - k2) R", 0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 0.8)
def umbilic(difference: float, rng) -> Case:
    """Both curvatures nearly equal."""
    k1, k2 = -0.4 + 0.5 * difference, -0.4 - 0.5 * difference
    return anywhere(quadric(k1, k2, random_turn(rng)), rng)


@family("k1 R, with k2 R = -0.4", 0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4)
def parabolic(second: float, rng) -> Case:
    """One curvature nearly zero."""
    return anywhere(quadric(second, -0.4, random_turn(rng)), rng)


@family("largest |k| R", 0.0, 1e-5, 1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)
def plane(bend: float, rng) -> Case:
    """Nearly a plane."""
    return anywhere(quadric(-bend, -bend * rng.uniform(0.0, 1.0), random_turn(rng)), rng)


@family("k1 R = -k2 R", 0.01, 0.03, 0.1, 0.3, 0.6, 1.0, 1.5, 2.0)
def saddle(bend: float, rng) -> Case:
    """Equal and opposite curvatures."""
    return anywhere(quadric(bend, -bend, random_turn(rng)), rng)


@family("size of x^3 - 3 x y^2 over R", 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.8)
def monkey_saddle(size: float, rng) -> Case:
    """z = size (x^3 - 3 x y^2), with K = 0 at the origin."""
    return anywhere(lambda x, y: size * (x**3 - 3.0 * x * y * y), rng)


@family("d^3z/dy^3 R^2", 0.01, 0.03, 0.1, 0.3, 0.6, 1.0, 1.5, 2.0)
def changing_sign(size: float, rng) -> Case:
    """K changes its sign across the patch, as on the top of a torus."""
    turn = random_turn(rng)
    c, s, bend = np.cos(turn), np.sin(turn), quadric(-0.4, 0.0, turn)
    return anywhere(total(bend, lambda x, y: size * (c * y - s * x) ** 3 / 6.0), rng)


@family(
    "height of the cubic between the curves at R, over R",
    *(0.0, 1e-3, 3e-3, 0.01, 0.02, 0.04, 0.08, 0.16),
)
def unseen_cubic(size: float, rng) -> Case:
    """A cubic that vanishes on all three curves: no sample knows of it."""
    plan = even_plan(rng, tilts=(0.0, 0.0, 0.0))
    lines = [(np.cos(a), np.sin(a)) for a in plan.angles]
    base = wavy(rng, 3.0)

    def cubic(x, y):
        return 4.0 * size * np.prod([c * y - s * x for c, s in lines], axis=0)

    return anywhere(total(base, cubic), rng, angles=plan.angles, tilts=plan.tilts)


@family("arms over the tube's radius", 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.5, 1.8)
def torus(reach: float, rng) -> Case:
    """Anywhere on a torus with a tube of radius 15."""
    return _on_object("torus", 15.0 * reach, rng)


@family("arc of an arm of a ball, rad", 0.2, 0.5, 0.8, 1.1, 1.4, 1.7, 2.0, 2.5)
def fold(arc: float, rng) -> Case:
    """A ball of radius 33: a height ends at 1.57."""
    return _on_object("ball", 33.0 * arc, rng)


def _on_object(surface: str, arm: float, rng) -> Case:
    """A touch of an object; its curves may turn by 170 degrees."""
    scene = draw_scene(surface, Plan.noise * arm, np.pi / 18.0, rng, turn=3.0, reach=arm)
    verifying = scene.verifying

    def around(point, distance: float):
        square = ((verifying - point) ** 2).sum(axis=1)
        near = square <= distance**2
        return verifying[near] if near.any() else verifying[[square.argmin()]]

    def at(point) -> Shape:
        foot = scene.surface.project(point[None])
        k1, k2, _ = scene.surface.principal_curvatures(foot)
        return Shape(scene.surface.normal(foot)[0], float(k1[0]), float(k2[0]))

    tracks = [Track(c.points, c.plane.point, c.plane.normal, c.noise_std) for c in scene.contours]
    truth, noise = Truth(around, at), scene.noise_std
    return Case(scene.contact, scene.normal, tuple(tracks), truth, noise, scene.reach)


@family("distance of an edge of 60 degrees over R", 1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1, 0.05)
def crease_distance(distance: float, rng) -> Case:
    """An edge of 60 degrees at this distance; the curves run over it."""
    edge = crease(distance, np.pi / 3.0, random_turn(rng, 2.0 * np.pi))
    return anywhere(total(edge, quadric(-0.1, -0.1)), rng)


@family("angle of an edge at 0.4 R, degrees", 0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 45.0, 80.0)
def crease_angle(angle: float, rng) -> Case:
    """An edge of this angle (degrees) at 0.4 of the reach."""
    edge = crease(0.4, np.deg2rad(angle), random_turn(rng, 2.0 * np.pi))
    return anywhere(total(edge, quadric(-0.1, -0.1)), rng)


@family("distance of three edges over R", 1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1, 0.05)
def corner(distance: float, rng) -> Case:
    """Three faces that fall by 45 degrees around a flat one, at this distance."""
    start = random_turn(rng, 2.0 * np.pi)
    edges = [crease(distance, np.pi / 4.0, start + 2.0 * np.pi / 3.0 * i) for i in range(3)]
    return anywhere(total(*edges), rng)


@family("height of a step at 0.4 R, in noise", 0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 200.0)
def step(height: float, rng) -> Case:
    """A step of this height (in noise) at 0.4 of the reach, 0.05 wide."""
    turn = random_turn(rng, 2.0 * np.pi)
    c, s, size = np.cos(turn), np.sin(turn), 0.5 * height * Plan.noise

    def ramp(x, y):
        return size * (1.0 + np.tanh((c * x + s * y - 0.4) / 0.025))

    return anywhere(total(wavy(rng), ramp), rng)


@family("amplitude of waves of 0.15 R, in noise", 0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
def texture_height(amplitude: float, rng) -> Case:
    """Waves of 0.15 reach, a little longer than the samples' spacing; amplitude in noise.

    Normal and curvatures are those of the surface without the waves.
    """
    base, waves = wavy(rng), _waves(rng, 0.15, amplitude * Plan.noise)
    touched = touch_graph(total(base, waves), even_plan(rng), rng)
    truth = Truth(touched.truth.around, graph_truth(base).at)
    return placed(replace(touched, truth=truth), rng)


@family("length of waves of 10 noises over R", 4.0, 2.0, 1.0, 0.5, 0.25, 0.12, 0.06, 0.03)
def texture_length(length: float, rng) -> Case:
    """Waves of ten noises; wavelength in reaches."""
    return anywhere(total(wavy(rng), _waves(rng, length, 10.0 * Plan.noise)), rng)


def _waves(rng, length: float, amplitude: float) -> Height:
    (one, two), turn = rng.uniform(0.0, 2.0 * np.pi, 2), random_turn(rng)
    c, s, k = np.cos(turn), np.sin(turn), 2.0 * np.pi / length
    return lambda x, y: (
        amplitude * (np.sin(k * (c * x + s * y) + one) * np.sin(k * (c * y - s * x) + two))
    )


@family("R over the feature length", 0.1, 0.3, 0.5, 0.7, 1.0, 2.0, 4.0, 8.0)
def radius(size: float, rng) -> Case:
    """A smooth surface that is touched too far: reach over its feature length."""
    return anywhere(wavy(rng, 1.0 / size), rng)


@family("curvature times R, contacts without noise", 0.01, 0.03, 0.1, 0.2, 0.4, 0.8, 1.2, 1.6)
def exact(bend: float, rng) -> Case:
    """Exact contacts on a smooth surface."""
    return anywhere(wavy(rng, 2.0, bend), rng, noise=0.0)
