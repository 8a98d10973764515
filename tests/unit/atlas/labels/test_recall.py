"""Recall: what was found of samples is not sought again, and changes nothing."""

from dataclasses import replace

import numpy as np

from tests.lawful import faces_before_last, known_body
from touchatlas.atlas.body.read_faces import faces_of_revised
from touchatlas.atlas.edges.blunt_edges import Rounding
from touchatlas.atlas.labels.labels import Labels
from touchatlas.atlas.labels.recall import Recall
from touchatlas.atlas.relabel.labelling import relabel


def is_known(recall: Recall) -> bool:
    """Whether a result is known: then it is not computed, and is not None."""
    return recall.get(lambda: None, "name", np.arange(3)) is not None


def test_a_result_is_known_in_the_labelling_after_and_forgotten_in_the_next():
    first = Recall()
    first.get(lambda: 1, "name", np.arange(3))
    assert is_known(Recall(first))
    assert not is_known(Recall(Recall(first)))


def labels_after(recalled: bool) -> Labels:
    """Labels of a box with rounded edges after its last two touches."""
    before, samples = faces_before_last("rounded", 34), known_body("rounded", 34).samples
    return relabel(samples, before if recalled else replace(before, recall=None))


def test_faces_are_the_same_with_what_was_found_before_and_without():
    """To the last bit: a resumed exploration knows nothing of it, and goes on alike."""
    one, other = (faces_of_revised(labels_after(known), rounds=1) for known in (True, False))
    assert np.array_equal(one.patch_of, other.patch_of)
    assert np.array_equal(one.rounded, other.rounded)
    for mine, theirs in zip(one.pieces, other.pieces, strict=True):
        assert mine.kind is theirs.kind
        assert np.array_equal(mine.coefficients, theirs.coefficients)


def test_edges_that_a_touch_leaves_alone_are_not_judged_again(monkeypatch):
    """Of a box, a touch meets few: with what was found before fewer are judged than without."""
    judged = []
    judge = Rounding._saved
    monkeypatch.setattr(Rounding, "_saved", lambda *args: judged.append(1) or judge(*args))
    counts = []
    for known in (True, False):
        judged.clear()
        faces_of_revised(labels_after(known), rounds=1)
        counts.append(len(judged))
    assert 0 < counts[0] < counts[1]
