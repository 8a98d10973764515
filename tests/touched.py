"""Samples of touches spread over a body, as an atlas keeps them, without an atlas."""

import numpy as np

from tests.kept import kept_once
from tests.sharp import sharp_object
from touchatlas.atlas.labels.samples import ContourSamples, contour_samples
from touchatlas.patch.geometry.section import contour_normals
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.planes import concurrent_planes
from touchatlas.sim import Probe
from touchatlas.sim.study.surface_peers import spread

# Lack of fit that an atlas bears, over the noise: AtlasOptions.bias of 0.2 tolerances is 0.02 mm.
BORNE = np.sqrt(2.0)


def touched(name: str, count: int, seed: int = 3):
    """A copy of points, outward directions, plane normals (n, 3) and the noise of spread
    touches."""
    return _touched(name, count, seed)


@kept_once
def _touched(name: str, count: int, seed: int):
    obj, rng = sharp_object(name), np.random.default_rng(seed)
    probe = Probe(obj, obj.noise_std, rng)
    # Points within the faces: a random sample is never on an edge.
    places, normals = obj.sample(20 * count, rng)
    contours = []
    for i in spread(places, count):
        heading = rng.normal(size=3)
        planes = concurrent_planes(places[i], normals[i], heading, 3)
        reach = 120.0 * obj.tolerance
        plan = ProbePlan(
            0, places[i], normals[i], planes, reach, reach / 12, np.pi / 3, Reason.START
        )
        contours += [(c, normals[i]) for c in probe(plan).contours if len(c.points) >= 5]
    points = np.concatenate([c.points_in_plane for c, _ in contours])
    outward = np.concatenate([contour_normals(c, a) for c, a in contours])
    planes = np.concatenate([np.tile(c.plane.normal, (len(c.points), 1)) for c, _ in contours])
    return points, outward, planes, obj.noise_std


def touched_samples(name: str, count: int, seed: int = 3) -> ContourSamples:
    """The same as ContourSamples."""
    points, outward, planes, noise = touched(name, count, seed)
    return contour_samples(points, outward, planes, BORNE * noise)
