"""The laws of the runner of all studies, on one that squares numbers."""

import csv

import pytest

from touchatlas.sim.study.cells import LEDGER, Cell
from touchatlas.sim.study.figures import canvas, image_bytes
from touchatlas.sim.study.study import Chart, Study, draw_chart, run

COLUMNS = ("number", "seed", "square", "note")


def squares(number, draws, seed):
    """The rows of one job; three is one that fails."""
    if number == 3:
        raise ArithmeticError("three has no square")
    values = (str(number), str(seed), str(number**2), "")
    return [dict(zip(COLUMNS, values, strict=True)) for _ in range(draws)]


def cells(names, draws, seed):
    numbers = [int(name) for name in names] or range(5)
    head = {"seed": str(seed)}
    return [Cell("t.csv", {"number": str(n)} | head, (n, draws, seed)) for n in numbers]


def picture(rows, summed):
    figure = canvas(2.0, 1.0)
    figure.subplots().plot([float(row["square"] or "nan") for row in rows])
    return {"curve": figure}


STUDY = Study("squares", COLUMNS, squares, "note")
CHART = Chart(
    *(STUDY, cells, lambda rows: [{"rows": len(rows)}], picture, lambda rows, summed: None, 2),
    keeps_summary=True,
)


def watched(seen):
    return lambda done, total: seen.append((done, total))


def measured(folder, names=(), draws=2, seed=0, seen=None):
    return run(STUDY, cells(names, draws, seed), folder, watched([] if seen is None else seen))


@pytest.mark.usefixtures("no_processes")
def test_rows_are_in_the_order_of_the_jobs_in_whatever_order_they_are_measured(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    rows = measured(tmp_path / "a", ("0", "1", "2"))
    again = measured(tmp_path / "b", ("2", "0", "1"))
    assert sorted(rows, key=lambda row: row["number"]) == rows
    assert again == [*rows[4:], *rows[:4]]


@pytest.mark.usefixtures("no_processes")
def test_an_interrupted_study_goes_on_and_ends_as_one_that_was_not(tmp_path):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    for folder in (whole, broken):
        folder.mkdir()
    numbers = ("0", "1", "2", "4")
    rows = measured(whole, numbers)

    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(STUDY, cells(numbers, 2, 0), broken, stop)
    with open(broken / "t.csv") as file:
        assert len({row["number"] for row in csv.DictReader(file)}) == 2
    seen = []
    assert measured(broken, numbers, seen=seen) == rows
    assert seen == [(2, 4), (3, 4), (4, 4)]
    assert (broken / "t.csv").read_bytes() == (whole / "t.csv").read_bytes()


@pytest.mark.usefixtures("no_processes")
def test_a_job_that_fails_is_a_row(tmp_path):
    rows = measured(tmp_path)
    failed = [row for row in rows if row["number"] == "3"]
    assert [row["note"] for row in failed] == ["ArithmeticError: three has no square"]
    assert len(rows) == 4 * 2 + 1


@pytest.mark.usefixtures("no_processes")
def test_rows_of_other_draws_or_seeds_are_measured_and_all_that_is_measured_is_kept(tmp_path):
    first = measured(tmp_path, ("0", "1"))
    for how in ({"draws": 3}, {"seed": 1}):
        seen = []
        measured(tmp_path, ("0",), **how, seen=seen)
        assert seen == [(0, 1), (1, 1)]
    seen = []
    assert measured(tmp_path, ("0", "1"), seen=seen) == first and seen == [(2, 2)]


@pytest.mark.usefixtures("no_processes")
def test_what_failed_is_measured_again(tmp_path):
    measured(tmp_path, ("2", "3"))
    seen = []
    measured(tmp_path, ("2", "3"), seen=seen)
    assert seen == [(1, 2), (2, 2)]


@pytest.mark.usefixtures("no_processes")
def test_a_line_that_was_cut_off_is_measured_again_and_one_of_others_is_refused(tmp_path):
    rows, ledger = measured(tmp_path, ("0", "1")), tmp_path / LEDGER
    ledger.write_bytes(ledger.read_bytes()[:-9])
    seen = []
    assert measured(tmp_path, ("0", "1"), seen=seen) == rows and seen == [(1, 2), (2, 2)]
    ledger.write_text("{}\n" + ledger.read_text())
    with pytest.raises(ValueError, match="line 1 of .* is none that a study writes"):
        measured(tmp_path, ("0", "1"))


@pytest.mark.usefixtures("no_processes")
def test_a_chart_writes_tables_and_pictures(tmp_path):
    rows, summed = draw_chart(CHART, tmp_path / "new" / "one", ("1", "2"))
    assert len(rows) == 4 and summed == [{"rows": 4}]
    written = {path.name: path.read_bytes() for path in (tmp_path / "new" / "one").iterdir()}
    assert written.keys() == {LEDGER, "t.csv", "curve.png", "curve.svg", "squares.csv"}
    assert written["curve.png"].startswith(b"\x89PNG")
    figure = picture(rows, summed)["curve"]
    for suffix in ("png", "svg"):
        assert image_bytes(figure, suffix) == written[f"curve.{suffix}"]


@pytest.mark.parametrize(
    ("options", "words"),
    [({"draws": 0}, "draws is 0; it must be >= 1"), ({"seed": -1}, "seed is -1; it must be >= 0")],
)
def test_mistakes_are_refused_before_anything_is_written(tmp_path, options, words):
    with pytest.raises(ValueError, match=words):
        draw_chart(CHART, tmp_path / "new", **options)
    assert not list(tmp_path.iterdir())
