"""All numbers of the paper's experiments, on stand-ins for its objects.

Every number is over fresh draws of the noise alone: reference points and planes stay.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from touchatlas.atlas import Touch
from touchatlas.patch import Contour, Patch
from touchatlas.patch.geometry.curvature import curvatures_from_sections, normal_from_tangents
from touchatlas.patch.geometry.frame import any_tangent, axes_from_normal
from touchatlas.patch.geometry.section import fit_sections
from touchatlas.patch.paper.curvature_on_grid import convex_hull
from touchatlas.patch.paper.gauss_map import GaussMap, gauss_map
from touchatlas.patch.paper.total_curvature import FoldProblem, fold_problem, objective
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim.study.cells import DONE, Cell, Ledger
from touchatlas.sim.study.fits import FITS, PAPER, PAPER_MULTIPLIER, Fit, height_error
from touchatlas.sim.study.scenes import POINTS_PER_ARM, REACH, arm_length
from touchatlas.sim.study.study import Watch, check_options, measure_cells
from touchatlas.sim.study.workers import WorkOptions
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.objects import make_object
from touchatlas.sim.world.probe import Probe

# How accurate the paper's Adept robot is.
NOISE = 0.02
# Of twelve curves, 15 degrees apart: those to fit, and those of the third row of table 1.
CURVES, DATA, OTHERS = 12, (0, 4, 8), (2, 6, 10)
PLAIN, DESCENT, FAST, OURS = "(3)", "(5)", "(5), fast solver", "fit_patch"
PAPERS_FITS: dict[str, Fit] = {
    PLAIN: FITS["least_squares"],
    DESCENT: FITS[PAPER],
    FAST: FITS["total_curvature"],
    OURS: FITS["map"],
}
# Object, and a point next to the place.
PLACES = {
    # Where its principal curvatures are nearest to the paper's.
    "neck": ("bottle", (20.0, 0.0, 45.0)),
    # Where it is most convex.
    "shoulder": ("bottle", (28.0, 0.0, 24.0)),
    "mouse": ("mouse", (8.0, -2.0, 19.0)),
    "ball": ("sphere", (33.0 / np.sqrt(3.0),) * 3),
}


@dataclass(frozen=True, eq=False)
class Visit:
    """One touch of a place, and which of its curves are fitted."""

    touch: Touch
    curves: Sequence[int] = DATA

    @property
    def contours(self) -> tuple[Contour, ...]:
        """The contours that are fitted."""
        return tuple(self.touch.contours[i] for i in self.curves)

    @property
    def data(self) -> np.ndarray:
        """(n, 3) points of the fitted curves, length, world."""
        return np.concatenate([contour.points for contour in self.contours])

    @property
    def verifying(self) -> np.ndarray:
        """(n, 3) points of all other curves of the touch, length, world."""
        others = [c.points for i, c in enumerate(self.touch.contours) if i not in self.curves]
        return np.concatenate(others)

    def patch(self, fit: str) -> Patch:
        """The patch by one of ``PAPERS_FITS``."""
        found = PAPERS_FITS[fit](self.touch.contact, self.contours, self.touch.approach)
        assert isinstance(found, Patch)
        return found

    def fold(self, patch: Patch) -> tuple[FoldProblem, np.ndarray]:
        """The problem (5) that the paper's fit solved for a patch, and its coefficients in it."""
        known, local = patch.curvatures, patch.frame.to_local(self.data)
        problem = fold_problem(local, known.k1, known.k2, PAPER_MULTIPLIER)
        return problem, patch.polynomial.coefficients[patch.polynomial.basis.orders >= 3]

    def gauss_map(self, patch: Patch) -> GaussMap:
        """Gauss map of a patch of the paper's over the hull of its projected curves."""
        return gauss_map(*self.fold(patch))


@dataclass(frozen=True, eq=False)
class Place:
    """A reference point on an object, with the exact answer.

    Parameters
    ----------
    surface : ImplicitObject
    point, normal : (3,) float, world
    k1, k2 : float, 1/length
        k1 >= k2; convex is negative.
    directions : (2, 3) float, unit, world
        Of k1 and of k2.
    """

    surface: ImplicitObject
    point: np.ndarray
    normal: np.ndarray
    k1: float
    k2: float
    directions: np.ndarray

    def plan(
        self,
        planes: int,
        points: int = POINTS_PER_ARM,
        reach: float = REACH,
        turn: float = np.pi / 4.0,
    ) -> ProbePlan:
        """A visit that tracks even points both ways in planes through the normal, evenly apart.

        Each arm has so many ``points``, the reference point not counted. All arms are as long as
        the first to turn by ``turn`` (rad), and no longer than the reach. The first plane is ten
        degrees from the first principal direction, so that no curve follows a symmetry.
        """
        ten, (e1, e2) = np.deg2rad(10.0), self.directions
        heading = np.cos(ten) * e1 + np.sin(ten) * e2
        chosen = concurrent_planes(self.point, self.normal, heading, planes)
        length = arm_length(self.surface, self.point, self.normal, chosen, reach, turn, 400)
        steps = length, length / points, np.pi
        return ProbePlan(0, self.point, self.normal, chosen, *steps, Reason.START)

    def visits(
        self, plan: ProbePlan, draws: int, rng: np.random.Generator, noise: float = NOISE
    ) -> Iterator[Visit]:
        """The same visit again and again, each time with fresh noise."""
        probe = Probe(self.surface, noise, rng)
        curves = DATA if len(plan.planes) == CURVES else range(len(plan.planes))
        for _ in range(draws):
            yield Visit(probe(plan), curves)


def place(name: str) -> Place:
    """One of ``PLACES``."""
    return place_at(*PLACES[name])


def place_at(name: str, near) -> Place:
    """The place of a built-in object next to a point (3,)."""
    obj = make_object(name)
    assert isinstance(obj, ImplicitObject)
    point = obj.project(np.array([near], dtype=float))
    k1, k2, directions = obj.principal_curvatures(point)
    return Place(obj, point[0], obj.normal(point)[0], float(k1[0]), float(k2[0]), directions[0])


def quadrant(count: int) -> list[Place]:
    """Places along the quadrant of the ellipse where y = 1 cuts the ellipsoid 8/5/3.

    Even in the ellipse's angle, from (0, 1, 6 sqrt 6 / 5) to (16 sqrt 6 / 5, 1, 0): the paper's
    figure 6.
    """
    angles = np.linspace(0.0, 0.5 * np.pi, count)
    along, up = 3.2 * np.sqrt(6.0) * np.sin(angles), 1.2 * np.sqrt(6.0) * np.cos(angles)
    return [place_at("ellipsoid_paper", [x, 1.0, z]) for x, z in zip(along, up, strict=True)]


def judged(fit: str, visit: Visit) -> dict[str, float]:
    """One draw of one fit.

    Returns
    -------
    dict
        ``k1``, ``k2``; ``data`` and ``verifying``, the means of |z(x_k, y_k) - z_k| on the
        fitted and on all other curves, and ``inside``, on the other curves within the hull D of
        the fitted ones, length; of the paper's fits also ``objective``, (5) over the number of
        points, length^2.
    """
    patch = visit.patch(fit)
    errors = np.abs(height_error(patch, visit.verifying))
    hull = convex_hull(patch.frame.to_local(visit.data)[:, :2]).equations
    flat = patch.frame.to_local(visit.verifying)[:, :2]
    inside = (flat @ hull[:, :2].T + hull[:, 2] <= 0.0).all(axis=1)
    found = {
        "k1": patch.curvatures.k1,
        "k2": patch.curvatures.k2,
        "data": float(np.abs(height_error(patch, visit.data)).mean()),
        "verifying": float(errors.mean()),
        "inside": float(errors[inside].mean()),
    }
    if fit != OURS:
        problem, coefficients = visit.fold(patch)
        found["objective"] = objective(problem, coefficients) / len(problem.target)
    return found


def spread(values) -> dict[str, float | None]:
    """Median, quartiles, mean and standard deviation; None where they are not finite.

    >>> spread([1.0, 2.0, 3.0, 4.0, 5.0])["upper"]
    4.0
    """
    values = np.sort(np.asarray(values, dtype=float))
    # A patch that a height does not meet has an infinite error, and the draws no mean.
    found = {
        "median": _quantile(values, 0.5),
        "lower": _quantile(values, 0.25),
        "upper": _quantile(values, 0.75),
        "mean": values.mean(),
        "std": values.std() if np.isfinite(values).all() else np.inf,
    }
    return {name: float(value) if np.isfinite(value) else None for name, value in found.items()}


def _quantile(values, fraction: float) -> float:
    """Of sorted values, linear between two of them; infinite where one of the two is."""
    low, part = divmod(fraction * (len(values) - 1), 1.0)
    below, above = values[int(low)], values[int(np.ceil(low + part))]
    return below if part == 0.0 else (1.0 - part) * below + part * above


def spreads(measures: Sequence[dict[str, float]]) -> dict[str, dict]:
    """The spread of each measure over the draws."""
    return {name: spread([found[name] for found in measures]) for name in measures[0]}


@dataclass(frozen=True)
class Row:
    """One row of table 1: a fit, its curves of the twelve, and the paper's own figures, if any."""

    fit: str
    curves: tuple[int, ...]
    paper: dict[str, float]


ROWS = (
    Row(PLAIN, DATA, {"k1": 0.0172, "k2": -0.0424, "data": 0.0459, "verifying": 11.8753}),
    Row(DESCENT, DATA, {"k1": 0.0172, "k2": -0.0424, "data": 0.0646, "verifying": 0.0681}),
    Row(DESCENT, OTHERS, {"k1": 0.019, "k2": -0.0453, "data": 0.0811, "verifying": 0.1531}),
    Row(FAST, DATA, {}),
    Row(OURS, DATA, {}),
)


def table1(draws: int, rng: np.random.Generator) -> dict:
    """The paper's table 1 in the bottle's neck."""
    neck = place("neck")
    plan = neck.plan(CURVES)
    visits = list(neck.visits(plan, draws, rng))
    rows = []
    for row in ROWS:
        own = [Visit(visit.touch, row.curves) for visit in visits]
        rows.append(
            {
                "fit": row.fit,
                "curves": "three" if row.curves == DATA else "three of the nine",
                "data_points": len(own[0].data),
                "verifying_points": len(own[0].verifying),
                **spreads([judged(row.fit, visit) for visit in own]),
                "paper": row.paper,
            }
        )
    return {"arm_length": plan.reach, "exact": {"k1": neck.k1, "k2": neck.k2}, "rows": rows}


def reaches(draws: int, rng: np.random.Generator) -> list[dict]:
    """Errors in the neck for arms of several lengths: the paper does not say how far its reach.
    Long arms may turn by 90 degrees."""
    neck, found = place("neck"), []
    for reach in (8.0, 12.0, 16.0, 20.0):
        visits = list(neck.visits(neck.plan(CURVES, reach=reach, turn=0.5 * np.pi), draws, rng))
        for fit in (PLAIN, DESCENT, OURS):
            measures = spreads([judged(fit, visit) for visit in visits])
            errors = {name: measures[name] for name in ("data", "verifying", "inside")}
            found.append({"arm_length": reach, "fit": fit, **errors})
    return found


def gauss_maps(draws: int, rng: np.random.Generator) -> dict[str, dict]:
    """Algebraic and absolute area of the Gauss map of the neck's patch by (3), by (5) and of the
    object, steradian: the paper's figure 4 in numbers."""
    neck = place("neck")
    found: dict[str, list[dict[str, float]]] = {PLAIN: [], DESCENT: [], "exact": []}
    for visit in neck.visits(neck.plan(3), draws, rng):
        for fit in (PLAIN, DESCENT):
            patch = visit.patch(fit)
            areas = visit.gauss_map(patch)
            found[fit].append({"algebraic": areas.algebraic_area, "absolute": areas.absolute_area})
        # Of both patches the one near to the surface.
        found["exact"].append(true_areas(neck, patch, visit))
    return {name: spreads(measures) for name, measures in found.items()}


def true_areas(place: Place, patch: Patch, visit: Visit) -> dict[str, float]:
    """Areas of the Gauss map of the object itself over the domain of a patch, steradian."""
    normal, surface = patch.frame.normal, place.surface
    points = patch.frame.to_world(visit.gauss_map(patch).points_local)
    # Newton's method along the normal, from a patch that is near to the surface.
    for _ in range(8):
        value, gradient = surface.field.first_order(points)
        points = points - (value / (gradient @ normal))[:, None] * normal
    k1, k2, _ = surface.principal_curvatures(points)
    area = k1 * k2 * visit.fold(patch)[0].spacing ** 2 / (surface.normal(points) @ normal)
    return {"algebraic": float(area.sum()), "absolute": float(np.abs(area).sum())}


def section_curvatures(visit: Visit) -> tuple[np.ndarray, float, float]:
    """Normal curvatures (m,) of sections, and k1 and k2 from them, 1/length.

    Notes
    -----
    The paper, section 2.1: a quadratic along each curve, the normal from the tangents, Meusnier,
    Euler.
    """
    sections = fit_sections(visit.touch.contact, visit.contours, visit.contours[0].noise_std)
    tangents = np.array([section.tangent for section in sections])
    normal = normal_from_tangents(tangents, visit.touch.approach)
    e1, e2, _ = axes_from_normal(normal, any_tangent(normal))
    along_normal = np.array([section.curvature_vector for section in sections]) @ normal
    angles = np.arctan2(tangents @ e2, tangents @ e1)
    stds = [section.curvature_std for section in sections]
    k1, k2, *_ = curvatures_from_sections(along_normal, angles, stds)
    return along_normal, k1, k2


def ellipsoid(draws: int, rng: np.random.Generator, points: int = 9) -> list[dict]:
    """k1 and k2 at points along the ellipsoid's quadrant, by both ways, beside the exact ones.

    Each curve has four neighbours of the point on either side. The paper's ellipsoid has no unit:
    it is as large as its robot's accuracy in millimetres, and less.
    """
    found = []
    for noise in (NOISE, 0.1 * NOISE):
        for spot in quadrant(points):
            plan = spot.plan(3, 4)
            visits = list(spot.visits(plan, draws, rng, noise))
            ours = [visit.patch(OURS).curvatures for visit in visits]
            found.append(
                {
                    "noise_std": noise,
                    "point": spot.point.tolist(),
                    "arm_length": plan.reach,
                    "exact": {"k1": spot.k1, "k2": spot.k2},
                    "sections": _pairs([section_curvatures(visit)[1:] for visit in visits]),
                    OURS: _pairs([(known.k1, known.k2) for known in ours]),
                }
            )
    return found


def sphere(draws: int, rng: np.random.Generator) -> dict:
    """Curvatures of the sphere of radius 33 from its sections, and errors of two patches."""
    ball = place("ball")
    plan = ball.plan(CURVES)
    visits = list(ball.visits(plan, draws, rng))
    found = [section_curvatures(visit) for visit in visits]
    return {
        "arm_length": plan.reach,
        "exact": ball.k1,
        "normal_curvatures": [spread(column) for column in np.array([f[0] for f in found]).T],
        **_pairs([f[1:] for f in found]),
        "patches": {
            fit: spreads([judged(fit, visit) for visit in visits]) for fit in (DESCENT, OURS)
        },
        "paper": {"normal_curvatures": [-0.0299, -0.0307, -0.0305], "k1": -0.0299, "k2": -0.0309},
    }


def _pairs(pairs) -> dict[str, dict]:
    return spreads([{"k1": k1, "k2": k2} for k1, k2 in pairs])


TABLES: dict[str, Callable] = {
    "table1": table1,
    "reaches": reaches,
    "gauss_map": gauss_maps,
    "ellipsoid": ellipsoid,
    "sphere": sphere,
}


def measure_table(name: str, draws: int, seed: int) -> list[dict[str, str]]:
    """One of the ``TABLES`` as a row of JSON; each table has a stream of its own of the seed."""
    streams = np.random.default_rng(seed).spawn(len(TABLES))
    numbers = TABLES[name](draws, streams[list(TABLES).index(name)])
    return [{"table": name, "numbers": json.dumps(numbers)}]


def paper_tables(
    folder: Path,
    draws: int = 50,
    seed: int = 0,
    watch: Watch = lambda done, total: None,
    work: WorkOptions = WorkOptions(),
    say: Callable[[str], None] = lambda words: None,
) -> dict:
    """All numbers, ready for JSON; each table is a cell of the folder's ledger.

    Parameters
    ----------
    folder : Path
    draws : int
        Of the noise, for every number.
    seed : int
    watch : callable
        Called with the number of tables done and of all, for progress.
    work : WorkOptions
    say : callable
        Called with sentences for the user.

    Returns
    -------
    dict
        ``TABLES`` by name, every measured value as its ``spread``, with the paper's figures in
        the project's signs: convex is negative. Lengths in millimetres, areas in steradian.

    Raises
    ------
    ValueError
        No draw, or a negative seed.
    RuntimeError
        A table that was not measured.
    """
    check_options(draws, seed)
    found: dict = {"draws": draws, "seed": seed, "noise_std": NOISE, "multiplier": PAPER_MULTIPLIER}
    cells = [Cell("", {}, (name, draws, seed)) for name in TABLES]
    with Ledger(folder) as ledger:
        measure_cells(ledger, measure_table, cells, watch, work, say)
    for name, cell in zip(TABLES, cells, strict=True):
        answer = ledger.answers[cell.key(measure_table)]
        if answer.kind != DONE:
            raise RuntimeError(f"{name}: {answer.words}")
        found[name] = json.loads(answer.rows[0]["numbers"])
    return found
