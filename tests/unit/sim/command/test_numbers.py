"""What the numbers of a run or an evaluation say in plain sentences."""

import json

import numpy as np
import pytest
import trimesh

from tests.command import touchatlas
from touchatlas.planner import StopReason
from touchatlas.sim.command.numbers import (
    allowed_places,
    ending,
    print_numbers,
    sentences,
    unit_hint,
)
from touchatlas.sim.judge.judgement import verdict


def numbers(**changes):
    return {"coverage": 1.0, "components": 1, "components_reached": 1, "hidden_area": 0.0} | changes


def test_a_whole_result_needs_no_words():
    assert sentences(numbers()) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"coverage": 0.7}, "30.0% of the true surface is farther than the tolerance"),
        ({"components": 3, "components_reached": 1}, "2 of the 3 separate parts of the object"),
        ({"hidden_area": 0.1}, "10.0% of the true surface lies inside, where no touch can reach"),
        ({"touches": 9, "touches_without_contact": 2}, "2 of 9 touches met nothing"),
    ],
)
def test_what_is_missing_is_said(changes, words):
    (sentence,) = sentences(numbers(**changes))
    assert words in sentence


@pytest.mark.parametrize(
    ("false", "missing", "words"),
    [(0.09, 0.1, "is met"), (0.11, 0.05, "is not met"), (0.05, 0.2, "is not met")],
)
def test_a_tolerance_is_met_both_ways_or_not_met(false, missing, words):
    found = verdict({"tolerance": 0.1, "accuracy_p95": false, "completeness_p95": missing})
    assert f"The tolerance 0.1 {words}: " in found
    assert f"within {false} of the truth" in found and f"within {missing} of the surface" in found


@pytest.mark.parametrize("met", [0.09, 0.2])
def test_an_error_of_more_than_the_tolerance_is_told_with_its_place(met):
    found = {"tolerance": 0.1, "accuracy_p95": met, "completeness_p95": met}
    found |= {"accuracy_max": 0.32, "accuracy_max_place": [1.0, -2.0, 0.5]}
    words = verdict(found)
    assert words.endswith(" The largest error of the surface is 3.2 tolerances, at (1, -2, 0.5).")
    assert words.startswith(f"The tolerance 0.1 is {'met, but not everywhere' * (met < 0.1)}")
    assert "largest" not in verdict(found | {"tolerance": 0.32})
    found |= {"completeness_max": 0.5, "completeness_max_place": [3.0, 0.0, 0.0]}
    missing = "The truth is up to 5.0 tolerances away from the surface, at (3, 0, 0)."
    assert verdict(found) == f"{words} {missing}"


def test_a_missing_hole_is_told_in_the_sentence_that_says_met():
    found = {"tolerance": 0.1, "accuracy_p95": 0.05, "completeness_p95": 0.05}
    holes = {"euler_characteristic": 2, "true_euler_characteristic": 0}
    words = verdict(found | holes)
    assert words.startswith("The tolerance 0.1 is met, but with other holes than the object has:")
    assert "Its Euler characteristic is 2, that of the object 0" in words
    assert "holes" not in verdict(found | holes | {"true_euler_characteristic": None})


def test_the_time_of_a_machine_is_told_with_the_end():
    """Of a probe without one it is null."""
    ended = {"touches": 2, "ended": "max_touches reached", "machine_seconds": 1234567.0}
    slow = "Ended after 2 touches and 1,234,567.0 s of the machine, 617,283.5 s a touch: max_"
    assert ending(ended).startswith(slow)
    assert (
        ending(ended | {"machine_seconds": None}) == "Ended after 2 touches: max_touches reached."
    )


def test_open_places_of_a_known_surface_are_explained():
    found = {"open_places": [[0.0, 0.0, 1.0]], "predicted_coverage": 0.997, "ended": "interrupted"}
    assert allowed_places(found) is None
    found["ended"] = StopReason.KNOWN.value
    words = allowed_places(found)
    assert words.startswith("1 place is open or less sure than 95%: (0, 0, 1).")
    assert "here 99.7%" in words
    four = allowed_places(found | {"open_places": [[0.0, 0.0, 1.0]] * 4})
    assert four.startswith("4 places are open") and " and 1 more." in four
    assert allowed_places(found | {"open_places": []}) is None


def test_what_a_table_counts_is_said_in_words(capsys):
    doubt = {"name": "misfit", "words": "Samples do not fit.", "places": []}
    print_numbers(numbers(warnings=["", ""], doubts=[doubt], coverage=0.7), "run", False, True)
    shown = capsys.readouterr()
    assert "1, said in words" in shown.out and "misfit" not in shown.out
    assert shown.err.splitlines() == [
        "touchatlas: 30.0% of the true surface is farther than the tolerance",
        "touchatlas: Samples do not fit",
    ]


def test_the_verdict_comes_first_then_ten_numbers(capsys):
    found = numbers(tolerance=0.1, accuracy_p95=0.05, completeness_p95=0.05, accuracy_rms=0.03)
    print_numbers(found, "run", False)
    shown = capsys.readouterr().out
    assert shown.index("is met") < shown.index("accuracy_p95") and "accuracy_rms" not in shown
    print_numbers(found, "run", False, every=True)
    assert "accuracy_rms" in capsys.readouterr().out


def test_nothing_is_met_or_not_where_there_is_no_surface():
    assert verdict({"tolerance": 0.1, "accuracy_p95": None, "completeness_p95": None}) is None


def test_names_units_and_meanings_stay_whole_beside_a_long_value(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    values = {"normal_error_deg_mean": 0.2, "accuracy_p95": 0.01, "ended": "long words " * 9}
    print_numbers(numbers(**values), "run", False, True)
    shown = capsys.readouterr().out
    assert "normal_error_deg_mean" in shown and "degree" in shown and "< tolerance" in shown


def test_sizes_that_differ_as_units_do_are_doubted():
    assert "0.001 times as large" in unit_hint(0.1, 100.0)
    assert "25.4 times as large" in unit_hint(25.4, 1.0)
    assert unit_hint(0.5, 1.0) is None and unit_hint(1.0, 1.0) is None


def test_a_surface_in_metres_against_millimetres_is_doubted(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=30.0)
    ball.export(tmp_path / "mm.ply")
    ball.apply_scale(1e-3).export(tmp_path / "m.ply")
    done = touchatlas("evaluate", "m.ply", "--truth", "mm.ply", "--json", cwd=tmp_path)
    assert done.returncode == 0 and "in the same unit" in done.stderr
    assert json.loads(done.stdout)["coverage"] == 0.0


def test_a_body_hidden_in_another_is_named(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=30.0)
    inner = trimesh.creation.icosphere(subdivisions=3, radius=5.0)
    trimesh.util.concatenate([ball, inner]).export(tmp_path / "two.ply")
    ball.export(tmp_path / "ball.ply")
    done = touchatlas("evaluate", "ball.ply", "--truth", "two.ply", "--json", cwd=tmp_path)
    assert "1 of the 2 separate parts of the object were not reached" in done.stderr
    # Areas of balls grow with the square of their radii.
    share = 25.0 / 925.0
    assert json.loads(done.stdout)["hidden_area"] == pytest.approx(share)
    assert f"{share:.1%} of the true surface lies inside" in done.stderr
    assert json.loads(done.stdout)["coverage"] == pytest.approx(1.0 - share, abs=0.005)
    assert np.isclose(json.loads(done.stdout)["accuracy_max"], 0.0, atol=1e-6)
