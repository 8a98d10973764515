"""Fits of one patch by name: ours, the paper's, and what others do with the same samples."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import igl
import numpy as np
from scipy.spatial import Delaunay

from touchatlas.patch import Contour, FitOptions, Patch, Penalty, fit_paper, fit_patch
from touchatlas.patch.entry_points import ESTIMATORS, load_added
from touchatlas.patch.geometry.frame import any_tangent, axes_from_normal
from touchatlas.patch.paper.newton import newton_minimum
from touchatlas.patch.paper.steepest_descent import sign_frozen_descent
from touchatlas.sim.study.heights import shape_of
from touchatlas.sim.study.scenes import POINTS_PER_ARM, Scene

# The paper's multiplier of (5), length^2, in millimetres as its objects are.
PAPER_MULTIPLIER = 0.3
# The paper's (5) by the paper's own solver.
PAPER = "steepest_descent"


@dataclass(frozen=True, eq=False)
class Jet:
    """Height over the plane of principal components.

    Parameters
    ----------
    origin : (3,) float, length, world
    axes : (3, 3) float, unit rows, world
        The last one is the outward direction of least variance.
    coefficients : (t,) float
        Of x^(d-j) y^j, ordered by degree d, then j; not scaled.
    degree : int
    k1, k2 : float, 1/length
        Principal curvatures above the origin, k1 >= k2, positive toward the last axis.
    """

    origin: np.ndarray
    axes: np.ndarray
    coefficients: np.ndarray
    degree: int
    k1: float
    k2: float

    def height_error(self, points) -> np.ndarray:
        """(n,) height of world points over the jet, length."""
        x, y, z = self.axes @ (points - self.origin).T
        return z - self.coefficients @ _terms(self.degree, x, y)


# Reference point, contours, and a vector on the outer side to a surface about the point.
Fit = Callable[[np.ndarray, tuple[Contour, ...], np.ndarray], Patch | Jet]


def ours(options: FitOptions) -> Fit:
    """The default of the project, or one with other options."""
    return lambda point, contours, outward: (
        fit_patch(point, contours, outward, options=options).patch
    )


def papers(penalty: Penalty, multiplier: float | None = PAPER_MULTIPLIER, solver=newton_minimum):
    """A fit of the paper; the multiplier None is free of units."""
    return lambda point, contours, outward: fit_paper(
        point, contours, outward, penalty, multiplier, solver
    )


def jet(degree: int) -> Fit:
    """An osculating jet."""

    def fit(point, contours, outward) -> Jet:
        return fit_jet(point, np.concatenate([c.points for c in contours]), outward, degree)

    return fit


FITS: dict[str, Fit] = {
    "map": ours(FitOptions()),
    "monge": ours(FitOptions(height_only=True, adaptive=False)),
    "least_squares": papers(Penalty.NONE),
    "total_curvature": papers(Penalty.TOTAL_CURVATURE),
    PAPER: papers(Penalty.TOTAL_CURVATURE, solver=sign_frozen_descent),
    "excess_curvature": papers(Penalty.EXCESS_CURVATURE),
    "jet_2": jet(2),
    "jet_4": jet(4),
}


def added_fits(names) -> dict[str, Fit]:
    """Estimators that other packages add, by their names."""
    return {name: load_added(ESTIMATORS, name) for name in names}


def height_error(found: Patch | Jet, points, steps: int = 20) -> np.ndarray:
    """(n,) heights of world points over a patch along its normal, length.

    The height z(x, y) is where the signed distance along the normal through each point vanishes,
    found by secants; infinite where they do not meet the patch.
    """
    if isinstance(found, Jet):
        return found.height_error(points)
    far, near, before = 1e3 * found.radius, 1e-12 * found.radius, np.zeros(len(points))
    height = -found.signed_distance(points)
    value = -height
    for _ in range(steps):
        ahead = found.signed_distance(points + height[:, None] * found.frame.normal)
        slope = ahead - value
        # Where it is found already, what is left of the slope is rounding.
        going = (np.abs(ahead) > near) & (slope != 0.0)
        step = (height - before) / np.where(going, slope, 1.0)
        before, value = height, ahead
        height = np.clip(np.where(going, height - ahead * step, height), -far, far)
    return np.where(np.abs(value) <= 1e3 * near, -height, np.inf)


def fit_jet(point, samples, outward, degree: int) -> Jet:
    """Osculating jet by plain least squares.

    Parameters
    ----------
    point : (3,) float, length, world
        Where the jet is wanted.
    samples : (n, 3) float, length, world
    outward : (3,) float, world
    degree : int

    Notes
    -----
    The algorithm of CGAL's Monge_via_jet_fitting (Cazals and Pouget, Estimating differential
    quantities using polynomial fitting of osculating jets, 2005), in numpy: frame of principal
    components, coordinates divided by their mean size, singular value decomposition with the
    solution of least norm, Weingarten map. The polynomial is kept over its fitting plane;
    CGAL's change to the Monge basis would cut off orders above the degree.
    """
    axes = _component_axes(samples, outward)
    x, y, z = axes @ (samples - point).T
    size = float(np.abs(x).mean() + np.abs(y).mean()) / 2.0
    scaled = np.linalg.lstsq(_terms(degree, x / size, y / size).T, z, rcond=None)[0]
    orders = np.repeat(np.arange(degree + 1), np.arange(1, degree + 2))
    coefficients = scaled / size**orders
    fx, fy, xx, xy, yy = coefficients[1:6]
    shape = shape_of(fx, fy, 2.0 * xx, xy, 2.0 * yy)
    return Jet(np.asarray(point), axes, coefficients, degree, shape.k1, shape.k2)


def _component_axes(samples, outward) -> np.ndarray:
    """(3, 3) principal components, the one of least variance last and outward."""
    centred = samples - samples.mean(axis=0)
    vectors = np.linalg.eigh(centred.T @ centred)[1]
    normal = vectors[:, 0] if vectors[:, 0] @ outward >= 0.0 else -vectors[:, 0]
    return axes_from_normal(normal, vectors[:, 2])


def _terms(degree: int, x, y) -> np.ndarray:
    """(t, n) monomials x^(d-j) y^j up to a degree."""
    return np.array([x ** (d - j) * y**j for d in range(degree + 1) for j in range(d + 1)])


def mesh_around(scene: Scene, rng: np.random.Generator):
    """Vertices (v, 3) and triangles (f, 3) about a scene's reference point, which comes first.

    Nine rings of a hexagonal lattice laid on the surface; its edges are in the mean as long as
    the steps of the contours, and its vertices have the same noise.
    """
    lattice, faces = _lattice(POINTS_PER_ARM)
    axes = axes_from_normal(scene.normal, any_tangent(scene.normal))[:2]
    wanted = step = scene.reach / POINTS_PER_ARM
    # On the surface the edges come out longer or shorter than in the tangent plane.
    for _ in range(6):
        vertices = scene.surface.project(scene.point + step * lattice @ axes)
        edges = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)
        step *= wanted / float(edges.mean())
    return vertices + scene.noise_std * rng.normal(size=vertices.shape), faces


@lru_cache
def _lattice(rings: int):
    """Hexagonal lattice (v, 2) of unit edges, its centre first, and triangles, anticlockwise."""
    i, j = np.mgrid[-rings : rings + 1, -rings : rings + 1].reshape(2, -1)
    ring = np.maximum(np.maximum(abs(i), abs(j)), abs(i + j))
    i, j = np.stack([i, j])[:, np.argsort(ring, kind="stable")][:, : (ring <= rings).sum()]
    points = np.stack([i + 0.5 * j, np.sqrt(0.75) * j], axis=1)
    faces = Delaunay(points).simplices.astype(np.int64)
    (ax, ay), (bx, by) = (points[faces[:, k]].T - points[faces[:, 0]].T for k in (1, 2))
    clockwise = ax * by < ay * bx
    faces[clockwise] = faces[clockwise, ::-1]
    return points, faces


def mesh_curvatures(vertices, faces) -> np.ndarray:
    """(v, 2) principal curvatures k1 >= k2 at the vertices of a mesh, by libigl's quadric fit.

    Panozzo, Puppo and Rocca, Efficient multi-scale curvature and crease estimation, 2010, with
    libigl's default: quadrics through five rings. libigl counts a ball's curvatures positive.
    """
    high, low = igl.principal_curvature(vertices, faces)[2:4]
    return -np.stack([np.minimum(high, low), np.maximum(high, low)], axis=1)
