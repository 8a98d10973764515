"""Places of the paper's experiments on stand-ins for its objects, and visits to them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from touchatlas.atlas import Touch
from touchatlas.patch import Contour, Patch
from touchatlas.patch.geometry.curvature import curvatures_from_sections, normal_from_tangents
from touchatlas.patch.geometry.frame import any_tangent, axes_from_normal
from touchatlas.patch.geometry.section import fit_sections
from touchatlas.patch.paper.gauss_map import GaussMap, gauss_map
from touchatlas.patch.paper.total_curvature import FoldProblem, fold_problem
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim.study.fits import FITS, PAPER, PAPER_MULTIPLIER, Fit
from touchatlas.sim.study.scenes import POINTS_PER_ARM, REACH, arm_length
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.objects import make_object
from touchatlas.sim.world.probe import Probe

# How accurate the paper's Adept robot is.
NOISE = 0.02
# Of twelve curves, 15 degrees apart, those to fit.
CURVES, DATA = 12, (0, 4, 8)
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
