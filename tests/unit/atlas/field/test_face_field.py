"""Points beside thin walls are of the side on which they lie."""

from collections import Counter

import numpy as np
import pytest

from tests.lawful import known_body
from tests.lawful_meshes import PIPE, ROD, lawful_object


@pytest.mark.slow
def test_each_side_of_the_wall_of_a_bent_pipe_is_its_own():
    """Its wall is thinner than touches are apart, so that the nearest sample of many points is of
    the other side. No point of the surface is taken for one of that: all are off by less than half
    of the wall, and less than 1 % by more than ten deviations of the noise."""
    body = known_body("pipe", 80)
    kinds = Counter(face.kind for face in body.faces.faces)
    assert kinds == {"cylinder": 4, "torus": 2, "plane": 2}
    points, _ = lawful_object("pipe").sample(5000, np.random.default_rng(0))
    found, known = body.at(points)
    assert known.mean() > 0.99
    off = np.abs(found.distance[known])
    assert off.max() < 0.5 * (ROD - PIPE)
    assert (off > 10.0 * body.samples.std).mean() < 0.01
