"""The graph of samples that goes on from that of the first of them is the one that is made at
once."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.touched import touched
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import ContourSamples, contour_samples


def first_touches(columns, contours, counts) -> list[ContourSamples]:
    """The samples of the first so many contours, each time."""
    bounds = np.append(np.flatnonzero(np.diff(contours, prepend=-1)), len(contours))
    points, outward, planes = columns
    return [contour_samples(points[:n], outward[:n], planes[:n], 0.02) for n in bounds[counts]]


def same(one: SampleGraph, other: SampleGraph) -> None:
    """Assert that two graphs are equal, bit for bit."""
    for name in "pairs", "weights", "neighbours", "neighbour_weights":
        assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("name", ["sphere", "cube"])
@pytest.mark.parametrize("seed", range(3))
def test_a_graph_that_goes_on_is_the_one_that_is_made_at_once(name, seed):
    """Few samples at first, all of which are near each other, then many."""
    points, outward, planes, _ = touched(name, 30, seed)
    contours = contour_samples(points, outward, planes, 0.02).contours
    some = np.sort(np.random.default_rng(seed).permutation(np.arange(1, 90))[:12])
    graph = None
    for samples in first_touches((points, outward, planes), contours, some):
        assert graph is None or graph.is_of_first(samples)
        graph = SampleGraph(samples, graph)
        same(graph, SampleGraph(samples))
