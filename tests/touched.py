"""Samples of touches spread over a body, as an atlas keeps them, without an atlas."""

import numpy as np

from tests.kept import kept_once
from tests.lawful import touched as touched_object
from tests.sharp import sharp_object
from touchatlas.atlas.labels.samples import ContourSamples, contour_samples

# Lack of fit that an atlas bears, over the noise: AtlasOptions.bias of 0.2 tolerances is 0.02 mm.
BORNE = np.sqrt(2.0)


@kept_once
def touched(name: str, count: int, seed: int = 3):
    """A copy of points, outward directions, plane normals (n, 3) and the noise of spread
    touches."""
    obj = sharp_object(name)
    columns = touched_object(
        obj, count, obj.noise_std, seed, 120.0 * obj.tolerance, 12, np.pi / 3.0
    )
    return *columns, obj.noise_std


def touched_samples(name: str, count: int) -> ContourSamples:
    """The same as ContourSamples."""
    points, outward, planes, noise = touched(name, count)
    return contour_samples(points, outward, planes, BORNE * noise)
