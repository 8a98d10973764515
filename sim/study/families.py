"""Families of one patch: ways to make a touch hard, each in steps of severity from easy to hard."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from touchatlas.sim.study.cases import (
    Case,
    Height,
    Plan,
    Shape,
    Track,
    Truth,
    crease,
    even_plan,
    graph_truth,
    placed,
    quadric,
    total,
    touch_graph,
    wavy,
)
from touchatlas.sim.study.scenes import draw_scene

# A Case of one patch, or the Trial of an exploration.
Drawn = TypeVar("Drawn")


@dataclass(frozen=True)
class Family(Generic[Drawn]):
    """Cases that differ in one number.

    Parameters
    ----------
    title : str
        What grows with the severity, and its unit.
    severities : tuple of float
        From easy to hard.
    draw : callable
        (severity, generator) to a Case, or to a Trial.
    """

    title: str
    severities: tuple[float, ...]
    draw: Callable[[float, np.random.Generator], Drawn]

    def case(self, name: str, severity: float, draw: int, seed: int):
        """Case number ``draw`` of the family called ``name``, and its generator.

        It depends on the seed, the name, the place of the severity and the number alone.
        """
        place = self.severities.index(severity)
        rng = np.random.default_rng([seed, *name.encode(), place, draw])
        return self.draw(severity, rng), rng


FAMILIES: dict[str, Family[Case]] = {}
# Noise of a good touch, samples of its contours, and the bend of its surface, in reaches.
NOISE, COUNT, BEND = Plan.noise, Plan.counts[0], 0.4


def family(title: str, *severities: float):
    """Enters a function of severity and generator in the table, under its own name."""

    def enter(draw: Callable[[float, np.random.Generator], Case]):
        FAMILIES[draw.__name__] = Family(title, severities, draw)
        return draw

    return enter


def anywhere(height: Height, rng: np.random.Generator, **changes) -> Case:
    """A touch of a graph at its origin, by an even plan with changes."""
    return placed(touch_graph(height, even_plan(rng, **changes), rng), rng)


def smooth(rng: np.random.Generator, **changes) -> Case:
    """A touch of a smooth random surface, by an even plan with changes."""
    return anywhere(wavy(rng), rng, **changes)


def _turn(rng, most: float = np.pi) -> float:
    return float(rng.uniform(0.0, most))


@family("(k1 - k2) R", 0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 0.8)
def umbilic(difference: float, rng) -> Case:
    """Both curvatures nearly equal."""
    k1, k2 = -BEND + 0.5 * difference, -BEND - 0.5 * difference
    return anywhere(quadric(k1, k2, _turn(rng)), rng)


@family("k1 R, with k2 R = -0.4", 0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4)
def parabolic(second: float, rng) -> Case:
    """One curvature nearly zero."""
    return anywhere(quadric(second, -BEND, _turn(rng)), rng)


@family("largest |k| R", 0.0, 1e-5, 1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)
def plane(bend: float, rng) -> Case:
    """Nearly a plane."""
    return anywhere(quadric(-bend, -bend * rng.uniform(0.0, 1.0), _turn(rng)), rng)


@family("k1 R = -k2 R", 0.01, 0.03, 0.1, 0.3, 0.6, 1.0, 1.5, 2.0)
def saddle(bend: float, rng) -> Case:
    """Equal and opposite curvatures."""
    return anywhere(quadric(bend, -bend, _turn(rng)), rng)


@family("size of x^3 - 3 x y^2 over R", 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4, 0.8)
def monkey_saddle(size: float, rng) -> Case:
    """z = size (x^3 - 3 x y^2), with K = 0 at the origin."""
    return anywhere(lambda x, y: size * (x**3 - 3.0 * x * y * y), rng)


@family("d^3z/dy^3 R^2", 0.01, 0.03, 0.1, 0.3, 0.6, 1.0, 1.5, 2.0)
def changing_sign(size: float, rng) -> Case:
    """K changes its sign across the patch, as on the top of a torus."""
    turn = _turn(rng)
    c, s, bend = np.cos(turn), np.sin(turn), quadric(-BEND, 0.0, turn)
    return anywhere(total(bend, lambda x, y: size * (c * y - s * x) ** 3 / 6.0), rng)


@family(
    "height of the cubic between the curves at R, over R",
    *(0.0, 1e-3, 3e-3, 0.01, 0.02, 0.04, 0.08, 0.16),
)
def unseen_cubic(size: float, rng) -> Case:
    """A cubic that vanishes on all three curves: no sample knows of it."""
    plan = even_plan(rng, tilts=(0.0, 0.0, 0.0))
    lines = [(np.cos(a), np.sin(a)) for a in plan.angles]
    base = wavy(rng, 3.0, BEND)

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
    scene = draw_scene(surface, NOISE * arm, np.pi / 18.0, rng, turn=3.0, reach=arm)
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
    edge = crease(distance, np.pi / 3.0, _turn(rng, 2.0 * np.pi))
    return anywhere(total(edge, quadric(-0.1, -0.1)), rng)


@family("angle of an edge at 0.4 R, degrees", 0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 45.0, 80.0)
def crease_angle(angle: float, rng) -> Case:
    """An edge of this angle (degrees) at 0.4 of the reach."""
    edge = crease(0.4, np.deg2rad(angle), _turn(rng, 2.0 * np.pi))
    return anywhere(total(edge, quadric(-0.1, -0.1)), rng)


@family("distance of three edges over R", 1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1, 0.05)
def corner(distance: float, rng) -> Case:
    """Three faces that fall by 45 degrees around a flat one, at this distance."""
    start = _turn(rng, 2.0 * np.pi)
    edges = [crease(distance, np.pi / 4.0, start + 2.0 * np.pi / 3.0 * i) for i in range(3)]
    return anywhere(total(*edges), rng)


@family("height of a step at 0.4 R, in noise", 0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 200.0)
def step(height: float, rng) -> Case:
    """A step of this height (in noise) at 0.4 of the reach, 0.05 wide."""
    turn = _turn(rng, 2.0 * np.pi)
    c, s, size = np.cos(turn), np.sin(turn), 0.5 * height * NOISE

    def ramp(x, y):
        return size * (1.0 + np.tanh((c * x + s * y - 0.4) / 0.025))

    return anywhere(total(wavy(rng), ramp), rng)


@family("amplitude of waves of 0.15 R, in noise", 0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
def texture_height(amplitude: float, rng) -> Case:
    """Waves of 0.15 reach, a little longer than the samples' spacing; amplitude in noise.

    Normal and curvatures are those of the surface without the waves.
    """
    base, waves = wavy(rng), _waves(rng, 0.15, amplitude * NOISE)
    touched = touch_graph(total(base, waves), even_plan(rng), rng)
    truth = Truth(touched.truth.around, graph_truth(base).at)
    return placed(replace(touched, truth=truth), rng)


@family("length of waves of 10 noises over R", 4.0, 2.0, 1.0, 0.5, 0.25, 0.12, 0.06, 0.03)
def texture_length(length: float, rng) -> Case:
    """Waves of ten noises; wavelength in reaches."""
    return anywhere(total(wavy(rng), _waves(rng, length, 10.0 * NOISE)), rng)


def _waves(rng, length: float, amplitude: float) -> Height:
    (one, two), turn = rng.uniform(0.0, 2.0 * np.pi, 2), _turn(rng)
    c, s, k = np.cos(turn), np.sin(turn), 2.0 * np.pi / length
    return lambda x, y: (
        amplitude * (np.sin(k * (c * x + s * y) + one) * np.sin(k * (c * y - s * x) + two))
    )


@family("R over the feature length", 0.1, 0.3, 0.5, 0.7, 1.0, 2.0, 4.0, 8.0)
def radius(size: float, rng) -> Case:
    """A smooth surface that is touched too far: reach over its feature length."""
    return anywhere(wavy(rng, 1.0 / size, BEND), rng)


@family("curvature times R, contacts without noise", 0.01, 0.03, 0.1, 0.2, 0.4, 0.8, 1.2, 1.6)
def exact(bend: float, rng) -> Case:
    """Exact contacts on a smooth surface."""
    return anywhere(wavy(rng, 2.0, bend), rng, noise=0.0)


@family("angle between planes, degrees", 60.0, 30.0, 10.0, 5.0, 2.0, 1.0, 0.3, 0.1)
def parallel_planes(angle: float, rng) -> Case:
    """Three planes this far apart; 60 is even."""
    start, turn = _turn(rng), np.deg2rad(angle)
    return smooth(rng, angles=(start, start + turn, start - turn))


@family(
    "angle of the third curve from the second, degrees",
    *(40.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.1, 0.0),
)
def situation_b(angle: float, rng) -> Case:
    """Two curves at plus and minus 50 degrees from e1 and a third this far (degrees) from one of
    them: the paper's situation (b), where all three normal curvatures agree."""
    turn, c = _turn(rng), np.deg2rad(50.0)
    angles = (turn + c, turn - c, turn - c + np.deg2rad(angle))
    return anywhere(quadric(0.1, -0.4, turn), rng, angles=angles)


@family(
    "lean of the planes from the normal, degrees", 0.0, 20.0, 40.0, 60.0, 70.0, 80.0, 85.0, 89.0
)
def grazing(tilt: float, rng) -> Case:
    """All planes lean this far from the normal, to either side."""
    return smooth(rng, tilts=tuple(np.deg2rad(tilt) * rng.choice([-1.0, 1.0], 3)))


@family("samples of each contour", 61.0, 31.0, 19.0, 13.0, 9.0, 7.0, 5.0, 4.0)
def few_points(count: float, rng) -> Case:
    """Few samples of each contour."""
    return smooth(rng, counts=(int(count),) * 3)


@family("curves", 9.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0)
def few_curves(count: float, rng) -> Case:
    """Curves, evenly spread, upright."""
    n = int(count)
    angles = tuple(_turn(rng) + np.pi / n * np.arange(n))
    plan = Plan(angles, (0.0,) * n, ((1.0, 1.0),) * n, (COUNT,) * n, (0.0,) * n)
    return touch_graph(wavy(rng), plan, rng).moved(np.eye(3), 20.0, np.zeros(3))


@family("length of one curve over the others'", 1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1, 0.02)
def short_curve(length: float, rng) -> Case:
    """One curve of this length over that of the others, its samples as close."""
    counts = (COUNT, COUNT, max(3, round(COUNT * length)))
    return smooth(rng, arms=((1.0, 1.0), (1.0, 1.0), (length, length)), counts=counts)


@family("length of one arm over R", 1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.03, 0.0)
def one_sided(arm: float, rng) -> Case:
    """One arm of one curve is this long; its other arm and all others are one reach."""
    return smooth(rng, arms=((1.0, 1.0), (1.0, 1.0), (arm, 1.0)))


@family("length of one arm of each curve over R", 1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.03, 0.0)
def all_one_sided(arm: float, rng) -> Case:
    """Every curve has one arm of this length: the point lies at the rim of what was touched."""
    return smooth(rng, arms=((arm, 1.0),) * 3)


@family("distance of the planes from the point over R", 0.0, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2, 0.4)
def missing_point(miss: float, rng) -> Case:
    """Planes that pass the reference point at this distance."""
    return smooth(rng, misses=tuple(miss * rng.choice([-1.0, 1.0], 3)))


@family("factor on all lengths", 1.0, 1e-6, 1e-4, 1e-2, 1e2, 1e4, 1e5, 1e6)
def scale(factor: float, rng) -> Case:
    """All lengths times this factor."""
    return smooth(rng).moved(np.eye(3), factor, np.zeros(3))


@family("distance from the origin over R", 0.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e8)
def far_away(sizes: float, rng) -> Case:
    """The touch lies this many reaches from the origin of the coordinates."""
    case, away = smooth(rng), rng.normal(size=3)
    return case.moved(np.eye(3), 1.0, sizes * case.reach * away / np.linalg.norm(away))


@family("fraction of repeated samples", 0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95)
def repeated_points(fraction: float, rng) -> Case:
    """This fraction of the samples repeats the one before."""

    def repeat(_, points):
        source = np.arange(len(points))
        source[1:][rng.uniform(size=len(points))[1:] < fraction] = 0
        return points[np.maximum.accumulate(source)]

    return smooth(rng).with_points(repeat)


@family("curves without length", 0.0, 1.0, 2.0, 3.0)
def still_curve(count: float, rng) -> Case:
    """So many of the three curves have no length: the probe did not move, but for noise."""
    return smooth(rng, arms=tuple((1e-9, 1e-9) if i < count else (1.0, 1.0) for i in range(3)))


@family("unit of one curve over that of the others", 1.0, 1.001, 1.01, 1.1, 2.0, 10.0, 25.4, 1000.0)
def other_unit(factor: float, rng) -> Case:
    """One curve of another unit: its coordinates about the point are this much larger."""
    case = smooth(rng)

    def stretched(track: Track) -> Track:
        points, through = (
            case.point + factor * (x - case.point) for x in (track.points, track.through)
        )
        return replace(track, points=points, through=through)

    return _first_changed(case, stretched)


@family("rotation of one curve, degrees", 0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 45.0)
def other_frame(angle: float, rng) -> Case:
    """One curve rotated about the reference point by this angle, with its plane."""
    case, axis, turn = smooth(rng), rng.normal(size=3), np.deg2rad(angle)
    axis /= np.linalg.norm(axis)

    def turned(v):
        along = (v @ axis)[..., None] * axis
        return along + np.cos(turn) * (v - along) + np.sin(turn) * np.cross(axis, v)

    def rotated(track: Track) -> Track:
        points, through = (
            case.point + turned(x - case.point) for x in (track.points, track.through)
        )
        return replace(track, points=points, through=through, normal=turned(track.normal))

    return _first_changed(case, rotated)


@family("error of one plane's normal, degrees", 0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 45.0)
def wrong_plane(angle: float, rng) -> Case:
    """The stated normal of one sampling plane is off by this angle."""
    turn = np.deg2rad(angle)

    def wrong(track: Track) -> Track:
        chord = track.points[-1] - track.points[0]
        chord /= np.linalg.norm(chord)
        normal = np.cos(turn) * track.normal + np.sin(turn) * np.cross(chord, track.normal)
        return replace(track, normal=normal / np.linalg.norm(normal))

    return _first_changed(smooth(rng), wrong)


def _first_changed(case: Case, change: Callable[[Track], Track]) -> Case:
    return replace(case, tracks=(change(case.tracks[0]), *case.tracks[1:]))


@family("noise over R", 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)
def noise(size: float, rng) -> Case:
    """Noise as stated."""
    return smooth(rng, noise=size)


@family("true over stated noise", 0.01, 0.1, 0.3, 1.0, 2.0, 5.0, 20.0, 100.0)
def stated_noise(ratio: float, rng) -> Case:
    """A probe that states another noise than it has."""
    return smooth(rng, stated=NOISE / ratio)


@family("fraction of bad contacts, all to one side", 0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
def bad_contacts(fraction: float, rng) -> Case:
    """Samples that are off along the normal by 10 to 100 noises, to one side."""
    case = smooth(rng)
    return case.with_points(lambda _, points: points + _bad(len(points), fraction, rng, case))


@family("fraction of bad contacts, to both sides", 0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
def bad_both_sides(fraction: float, rng) -> Case:
    """As ``bad_contacts``, to either side."""
    case = smooth(rng)

    def change(_, points):
        side = rng.choice([-1.0, 1.0], (len(points), 1))
        return points + side * _bad(len(points), fraction, rng, case)

    return case.with_points(change)


def _bad(count: int, fraction: float, rng, case: Case) -> np.ndarray:
    off = case.noise_std * rng.uniform(10.0, 100.0, count) * (rng.uniform(size=count) < fraction)
    return off[:, None] * case.outward


@family("drift at the end of a contour, in noise", 0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
def drift(size: float, rng) -> Case:
    """Each contour drifts along the normal, as a random walk that ends at this many noises."""
    case = smooth(rng)

    def change(_, points):
        walk = np.cumsum(rng.normal(size=len(points))) / np.sqrt(len(points))
        return points + size * case.noise_std * walk[:, None] * case.outward

    return case.with_points(change)


@family("offset of one curve, in noise", 0.0, 0.5, 1.0, 2.0, 4.0, 10.0, 30.0, 100.0)
def contradiction(size: float, rng) -> Case:
    """One curve lies this many noises above the others: the object moved."""
    case = smooth(rng)
    off = size * case.noise_std * rng.choice([-1.0, 1.0]) * case.outward
    return case.with_points(lambda i, points: points + off if i == 0 else points)


@family("noise of one curve over that of the others", 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 100.0)
def uneven_noise(ratio: float, rng) -> Case:
    """One curve has this many times the noise of the others, and says so."""
    case = smooth(rng)
    extra = case.noise_std * np.sqrt(ratio**2 - 1.0)

    def noisier(track: Track) -> Track:
        points = track.points + extra * rng.normal(size=track.points.shape)
        return replace(track, points=points, noise_std=ratio * case.noise_std)

    return _first_changed(case, noisier)
