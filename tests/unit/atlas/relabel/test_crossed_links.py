"""Links between samples of one face do not pass through another."""

import numpy as np
import pytest

from tests.touched import touched_samples
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import Labels
from touchatlas.atlas.labels.options import FaceOptions
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.relabel.crossed_links import cut_crossed_links
from touchatlas.atlas.relabel.labelling import label_samples

# Touches of a body. Where contours are far apart, the nearest samples of one top are on the other.
TOUCHES = {"slot": 36, "block": 40, "roof": 40}


def labels_of(name: str) -> Labels:
    """The labels of a touched body, with all links."""
    samples = touched_samples(name, TOUCHES[name])
    labelled = label_samples(samples)
    labels = Labels(Evidence(samples, SampleGraph(samples), FaceOptions()))
    labels.resume(labelled.pieces, labelled.of)
    return labels


def over_the_slot(labels: Labels) -> int:
    """How many links join samples of the tops of the two blocks, at x < -6 and x > 6, z = 10. A
    sample on the edge of a top may be of the wall below."""
    pairs = labels.graph.pairs
    ends, of = labels.evidence.samples.points[pairs], labels.of[pairs]
    level = np.array([piece.axes[2, 2] > 0.9 for piece in labels.pieces] + [False])
    top = (np.abs(ends[..., 2] - 10.0) < 0.1).all(axis=1) & level[of].all(axis=1)
    return int((top & (ends[..., 0].min(axis=1) < -5.9) & (ends[..., 0].max(axis=1) > 5.9)).sum())


def test_no_link_passes_over_a_slot():
    """Chords across it fit the normals of both tops; they pass through its walls."""
    labels = labels_of("slot")
    assert over_the_slot(labels) > 0
    cut_crossed_links(labels)
    assert over_the_slot(labels) == 0


@pytest.mark.parametrize("name", ["block", "roof"])
def test_links_within_a_convex_body_stay(name):
    """The line between two points of a face of a convex body lies in the face, and passes through
    no other. Samples beside an edge may lie beyond it, within their noise, and small pieces that a
    single contour met cross faces: 1 in 65 links was cut."""
    labels = labels_of(name)
    of, pairs = labels.of, labels.graph.pairs
    inner = np.count_nonzero(of[pairs[:, 0]] == of[pairs[:, 1]])
    cut_crossed_links(labels)
    left = labels.graph.pairs
    assert np.count_nonzero(of[left[:, 0]] == of[left[:, 1]]) >= 0.98 * inner
