"""Bodies of planes, cylinders and spheres, touched at places spread evenly, as an atlas
keeps them, without an atlas."""

from functools import lru_cache

import numpy as np

from tests.kept import kept_once
from tests.lawful_meshes import BLUNT, HALF, lawful_object
from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.read_faces import determined, faces_of_samples
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.labels.samples import ContourSamples, contour_samples
from touchatlas.patch.geometry.section import contour_normals
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim import Probe, make_object
from touchatlas.sim.study.surface_peers import spread

# Standard deviation of the samples of known bodies.
NOISE = 0.02


@lru_cache
def touched_mesh(name: str, count: int, noise: float, seed: int = 3):
    """Points, outward directions and plane normals (n, 3) of ``count`` touches of three contours,
    which run over edges."""
    return touched(lawful_object(name), count, noise, seed, 16.0, 16)


@lru_cache
def touched_plate(count: int, noise: float, seed: int):
    """The same of the built-in plate, whose edges and corners are rounded, with longer arms."""
    return touched(make_object("plate"), count, noise, seed, 30.0, 18)


def touched(obj, count: int, noise: float, seed: int, reach: float, samples: int, turn=np.pi):
    """The same of an object, by contours of a reach and so many steps each way, which turn by an
    angle at most."""
    rng = np.random.default_rng(seed)
    probe = Probe(obj, noise, rng)
    # Points within the faces: a random sample is never on an edge.
    places, normals = obj.sample(20 * count, rng)
    contours = []
    for i in spread(places, count):
        planes = concurrent_planes(places[i], normals[i], rng.normal(size=3), 3)
        plan = ProbePlan(
            0, places[i], normals[i], planes, reach, reach / samples, turn, Reason.START
        )
        contours += [(c, normals[i]) for c in probe(plan).contours if len(c.points) >= 5]
    points = np.concatenate([c.points_in_plane for c, _ in contours])
    outward = np.concatenate([contour_normals(c, a) for c, a in contours])
    planes = np.concatenate([np.tile(c.plane.normal, (len(c.points), 1)) for c, _ in contours])
    return points, outward, planes


def samples_of_touches(columns, std: float, keep=None, scale: float = 1.0) -> ContourSamples:
    """Samples of points, directions and planes (n, 3), those that ``keep`` (n,) says, scaled."""
    points, outward, planes = columns if keep is None else [column[keep] for column in columns]
    return contour_samples(scale * points, outward, planes, scale * std)


def body_of(samples: ContourSamples) -> Body:
    return Body(determined(faces_of_samples(samples), samples), samples)


@kept_once
def known_body(name: str, count: int, scale: float = 1.0) -> Body:
    """A copy of a body by so many touches with ``NOISE``, made once for all tests. An equal share
    of the variance is borne for lack of fit."""
    columns = touched_mesh(name, count, NOISE)
    return body_of(samples_of_touches(columns, np.sqrt(2.0) * NOISE, scale=scale))


@kept_once
def faces_before_last(name: str, count: int) -> Faces:
    """A copy of the faces of the samples of such a body but for those of its last two touches."""
    samples = known_body(name, count).samples
    first = samples.touches < samples.touches.max() - 1
    columns = samples.points, samples.outward, samples.planes
    return faces_of_samples(samples_of_touches(columns, samples.std, first))


def step_distance(points) -> np.ndarray:
    """(n,) signed distance of points (n, 3) from a step by its planes: the least of two blocks'."""
    x, y, z = points.T
    low = np.maximum.reduce([-x, y - 20.0])
    high = np.maximum.reduce([30.0 - x, y - 40.0, x - 60.0])
    return np.maximum.reduce([np.minimum(low, high), -y, -z, z - 30.0])


def box_distance(points) -> np.ndarray:
    """(n,) the largest distance of points (n, 3) from the six planes of a box."""
    return (np.abs(points) - HALF).max(axis=1)


def rounded_box_distance(points) -> np.ndarray:
    """(n,) the distance of points (n, 3) from a box whose edges are rounded: that from a smaller
    box less the radius."""
    beyond = np.abs(points) - (HALF - BLUNT)
    outside = np.sqrt((np.maximum(beyond, 0.0) ** 2).sum(axis=1))
    return outside + np.minimum(beyond.max(axis=1), 0.0) - BLUNT
