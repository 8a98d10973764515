"""SampleGraph: links between neighbouring samples."""

import numpy as np
import pytest

from tests.touched import BORNE, touched, touched_samples
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import contour_samples


@pytest.mark.parametrize("name", ["block", "step"])
def test_links_do_not_depend_on_how_many_samples_came_at_once(name):
    """The same to the last bit, after each touch and at the end."""
    *columns, noise = touched(name, 40)
    touches, graph = touched_samples(name, 40).touches, None
    for count in (1, 3, 4, 20, 21, 40):
        some = (column[touches < count] for column in columns)
        samples = contour_samples(*some, BORNE * noise)
        graph, whole = SampleGraph(samples, graph), SampleGraph(samples)
        assert np.array_equal(graph.pairs, whole.pairs)
        assert np.array_equal(graph.weights, whole.weights)


def test_links_of_other_samples_say_nothing():
    samples = touched_samples("block", 20)
    graph = SampleGraph(samples, SampleGraph(touched_samples("step", 20)))
    assert np.array_equal(graph.pairs, SampleGraph(samples).pairs)
