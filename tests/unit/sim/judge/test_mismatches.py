"""When runs do not fit together."""

import pytest

from touchatlas.sim.judge.mismatches import differ_as_units, mismatches_of

RUN = {"object": "a.ply", "digest": "1", "tolerance": 0.1, "versions": {"numpy": "2.0"}}


def mismatches(*sizes, **changes):
    second = RUN | changes
    return mismatches_of([RUN, second], [{"diagonal": size} for size in sizes or (3.0, 3.0)])


def test_runs_that_differ_in_options_alone_fit_together():
    assert mismatches() == mismatches(seed=3, planner={"curves": 4}) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"object": "b.ply"}, "of different objects"),
        ({"object": "b.ply", "digest": "2"}, "of different objects"),
        ({"digest": "2"}, "a.ply was changed between the runs"),
        ({"tolerance": 0.2}, "the tolerances differ"),
        ({"versions": {"numpy": "2.1"}}, "different versions of numpy"),
        ({"versions": 3}, "different versions of numpy"),
    ],
)
def test_what_else_differs_is_said(changes, words):
    (sentence,) = mismatches(**changes)
    assert words in sentence


def test_objects_in_different_units_are_doubted():
    (sentence,) = mismatches(100.0, 0.1)
    assert "one object is 1000 times as large as another" in sentence
    assert mismatches(100.0, 90.0) == mismatches("large", None) == []


@pytest.mark.parametrize("ratio", [10.0, 25.4, 1000.0, 12.0])
def test_neither_order_nor_scale_matters(ratio):
    for scale in (1e-6, 1.0, 1e6):
        assert differ_as_units(scale, ratio * scale) and differ_as_units(ratio * scale, scale)
        assert not differ_as_units(scale, 2.0 * scale)
