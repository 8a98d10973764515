"""STUDY.toml: what it says, what is refused, its runs, statistics and report."""

import csv
import re

import numpy as np
import pytest
import trimesh
from scipy.stats import norm

from tests.command import assert_refused, touchatlas
from touchatlas.sim import RunOptions
from touchatlas.sim.study.cells import LEDGER, LIMITED, Answer
from touchatlas.sim.study.compare import comparisons, median_interval, share_interval
from touchatlas.sim.study.course import FIGURES, TIMED
from touchatlas.sim.study.study import run
from touchatlas.sim.study.study_file import read_study
from touchatlas.sim.study.study_pictures import pictures
from touchatlas.sim.study.study_report import write_report
from touchatlas.sim.study.sweep import runs_of, sweep
from touchatlas.sim.study.workers import Here, WorkOptions

TEXT = """
objects = ["sphere", "box.stl", "more"]
seeds = "3-4"
[options]
max-touches = 5
[vary]
planner = ["random", "tolerance"]
tolerance = ["1e-2 diagonal", "3e-2 of the diagonal"]
[baseline]
planner = "random"
[limits]
seconds = 60
"""


@pytest.fixture
def file(tmp_path):
    box = trimesh.creation.box((10.0, 20.0, 30.0))
    (tmp_path / "more").mkdir()
    for name in ("box.stl", "more/a.ply", "more/b.off"):
        box.export(tmp_path / name)
    (tmp_path / "more" / "notes.txt").write_text("no mesh")
    (tmp_path / "one.toml").write_text(TEXT)
    return tmp_path / "one.toml"


def test_every_object_has_every_value_with_every_other_and_every_seed(file):
    study = read_study(file)
    cells = study.cells()
    assert len(cells) == 4 * (2 * 2) * 2 == len({cell.key(read_study) for cell in cells})
    assert {cell.head["object"] for cell in cells} == {"sphere", "box", "a", "b"}
    last = cells[-1]
    assert last.head == {
        **{"object": "b", "planner": "tolerance", "tolerance": "3e-2 of the diagonal"},
        "seed": "4",
    }
    _, digest, table, fractions, seed = last.given
    assert len(digest) == 64 and fractions == {"tolerance": 0.03} and seed == 4
    assert table == {"max_touches": 5, "planner": {"name": "tolerance"}}
    assert study.work.limits.seconds == 60.0


def test_options_are_written_as_in_run_toml_too(file):
    """Dotted names and tables, as TOML reads them, are the flags of the command line."""
    text = TEXT.replace('planner = "random"', 'planner.name = "random"')
    text = text.replace("planner = [", "planner.name = [")
    probe = '[options.probe]\nname = "scanning"\nnormals = false\n'
    file.write_text(text.replace("[vary]", f"{probe}[vary]"))
    nested = read_study(file)
    flat = 'probe = "scanning"\n"probe.normals" = false\n'
    file.write_text(TEXT.replace("[vary]", f"{flat}[vary]"))
    assert [cell.given for cell in nested.cells()] == [c.given for c in read_study(file).cells()]
    assert nested.fixed["probe.name"] == "scanning"


def test_a_mesh_of_other_bytes_is_another_cell(file):
    before = {cell.key(read_study) for cell in read_study(file).cells()}
    trimesh.creation.box((11.0, 20.0, 30.0)).export(file.parent / "box.stl")
    after = {cell.key(read_study) for cell in read_study(file).cells()}
    assert len(before - after) == 8


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seeds", "seed", "has seed, which is no key of a study; did you mean seeds?"),
        ('"3-4"', '"3 to 4"', "seeds is '3 to 4'; it must be a number of seeds, a range"),
        ('"sphere"', '"spher"', "'spher' of objects is neither .*; did you mean sphere?"),
        ('"box.stl"', "3", "objects is .*; it must be a list of names"),
        ("max-touches", "max-touch", "has options.max-touch, which is no flag .*; did you mean"),
        ("max-touches = 5", "seed = 5", r"has options.seed; give seeds = \[...\] beside it"),
        ("max-touches = 5", "max-touches = 0", "max-touches is 0; it must be"),
        ("max-touches = 5", "tolerance = 5", "gives tolerance twice; leave one of them out"),
        ('["random", "tolerance"]', '"random"', "vary.planner is 'random'; it must be a list"),
        ('"tolerance"]', '"tolerances"]', "the planner is 'tolerances'; it must be one of"),
        ('\nplanner = "random"', '\nplanner = "oracle"', "baseline.planner is 'oracle'; it must"),
        ("seconds = 60", "seconds = -1", "limits.seconds is -1; it must be a number > 0"),
        ("seconds = 60", "second = 1", "has limits.second, .*; did you mean seconds?"),
        ('"1e-2 diagonal"', '"1e-9 diagonal"', r"give a .* \(in sphere, planner = random, tol"),
        ("[options]", 'table = "xls"\n[options]', "table is 'xls'; it must be \"csv\" or"),
        ("[options]", "[options", "cannot be read as TOML"),
    ],
)
def test_a_mistake_is_refused_in_one_sentence(file, old, new, words):
    assert old in TEXT
    file.write_text(TEXT.replace(old, new))
    with pytest.raises(ValueError, match=words) as refusal:
        read_study(file)
    assert "one.toml" in str(refusal.value) and "\n" not in str(refusal.value)


@pytest.mark.usefixtures("no_processes")
def test_equal_seeds_give_equal_tables_and_a_report(tmp_path):
    file = tmp_path / "small.toml"
    file.write_text(
        'objects = ["sphere"]\n[options]\nmax_touches = 2\nnoise = 0.5\n'
        '[vary]\ntolerance = ["2e-2 diagonal"]\n'
    )
    study, seen = read_study(file), []
    rows, _ = sweep(study, file, tmp_path / "a")
    (tmp_path / "b").mkdir()
    run(runs_of(study), study.cells(), tmp_path / "b", lambda done, total: None)
    assert [row["touches"] for row in rows] == ["2"] and float(rows[0]["seconds"]) > 0.0
    assert rows[0]["tolerance"] == "2e-2 diagonal"
    used, diagonal = (float(rows[0][name]) for name in ("tolerance_used", "diagonal"))
    assert used == pytest.approx(0.02 * diagonal, rel=1e-5)  # six digits are written
    assert (tmp_path / "a/runs.csv").read_bytes() == (tmp_path / "b/runs.csv").read_bytes()
    with open(tmp_path / "a" / "runs.csv") as table:
        assert tuple(csv.DictReader(table).fieldnames) == ("object", "tolerance", "seed", *FIGURES)
    watch = lambda done, total: seen.append((done, total))  # noqa: E731
    assert run(runs_of(study), study.cells(), tmp_path / "a", watch) == rows and seen == [(1, 1)]
    assert {path.name for path in (tmp_path / "a").iterdir()} == {
        *(LEDGER, "runs.csv", "times.csv", "study.toml"),
        *("report.html", "report.pdf", "summary.json"),
    }


SMALL = """objects = ["sphere"]
seeds = {seeds}
[options]
max_touches = 1
tolerance = {tolerance}
"""


def small_study(folder, seeds=1, tolerance=2.0, force=()):
    """Carry out the study small.toml of a folder."""
    folder.mkdir(exist_ok=True)
    (folder / "small.toml").write_text(SMALL.format(seeds=seeds, tolerance=tolerance))
    words = folder / "small.toml", "--workers", "0", *force
    return touchatlas("study", *words, cwd=folder.parent)


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_study_goes_on_with_more_seeds_and_another_of_the_same_name_is_refused(
    tmp_path, monkeypatch
):
    """No report is written, which takes most of the time of a small study."""
    monkeypatch.setattr("touchatlas.sim.study.sweep.write_report", lambda *_: [])
    for seeds in (1, 2, 2):
        assert small_study(tmp_path / "a", seeds).returncode == 0
    out, held = tmp_path / "runs" / "small", contents(tmp_path / "runs")
    assert len((out / "runs.csv").read_text().splitlines()) == 3
    done = small_study(tmp_path / "b", 2, 3.0)
    words = f"holds a study with 2 runs that {tmp_path}/b/small.toml has not; choose another --out"
    assert_refused(done, 2, words)
    assert contents(tmp_path / "runs") == held
    # One run of two is left out, and the other is kept.
    assert_refused(small_study(tmp_path / "b", 1), 2, "holds a study with 1 run that")
    assert small_study(tmp_path / "b", 1, force=["--force"]).returncode == 0
    lines = held[out / LEDGER].splitlines(keepends=True)
    assert (out / LEDGER).read_bytes() == lines[0]
    assert small_study(tmp_path / "b", 1).returncode == 0


def test_a_study_leaves_what_is_no_study_alone(tmp_path):
    out = tmp_path / "runs" / "small"
    out.mkdir(parents=True)
    (out / "notes.txt").write_text("mine")
    assert_refused(small_study(tmp_path / "a"), 2, "runs/small is not empty; choose another --out")
    (out / "runs.csv").write_text("mine")
    done = small_study(tmp_path / "a", force=["--force"])
    assert_refused(done, 2, "runs/small holds runs.csv, of no study, which a study would overwrite")
    assert {path.name for path in out.iterdir()} == {"notes.txt", "runs.csv"}


def test_a_study_of_which_no_run_has_a_result_is_a_failure(tmp_path, monkeypatch):
    answer = Answer(LIMITED, words="it exceeded its time of 1 s")
    monkeypatch.setattr(Here, "answers", lambda _, measure, given: ((k, answer) for k in given))
    done = small_study(tmp_path / "a")
    assert_refused(done, 1, "no run has a result; the column ended of runs/small/runs.csv says why")
    assert "1 run is in runs/small" in done.stdout


def row(name, seed, planner, touches, met="1"):
    cells = dict.fromkeys((*FIGURES, *TIMED), "1")
    cells |= {"object": name, "seed": str(seed), "planner": planner, "met": met}
    return cells | {"touches": str(touches)}


def many(factor):
    """Sixteen pairs, one of which only the baseline met."""
    rows = [row("sphere", seed, "random", 10 + seed) for seed in range(17)]
    # No two ratios are the same.
    ours = [(factor + 1e-3 * seed) * (10 + seed) for seed in range(16)]
    rows += [row("sphere", seed, "tolerance", touches) for seed, touches in enumerate(ours)]
    return [*rows, row("sphere", 16, "tolerance", 99, "0")]


def test_a_planner_that_takes_half_is_found_to_take_half():
    costs, met = comparisons(many(0.5), ["planner"], {"planner": "random"})
    touches = costs[0]
    assert (touches.cost, touches.pairs, touches.less, touches.more) == ("touches", 16, 16, 0)
    assert 0.5 < touches.low < touches.ratio < touches.high < 0.515
    assert touches.ratio == pytest.approx(0.5075)
    # All 2^16 signs are alike under the null hypothesis, of which two are as extreme.
    assert touches.p == pytest.approx(2.0 / 2**16, rel=1e-9)
    assert met == [("tolerance", 17, 0, 1, 1.0)]


def test_an_interval_of_a_median_holds_it_as_often_as_it_says():
    """The share of 500 samples of 15 whose interval holds 0, within 4 standard errors above the
    level: the interval of order statistics is conservative, here 0.965."""
    rng = np.random.default_rng(0)
    held = [median_interval(rng.normal(size=15)) for _ in range(500)]
    share = np.mean([low <= 0.0 <= high for _, low, high in held])
    assert 0.965 - 4.0 * np.sqrt(0.035 / 500) < share < 0.965 + 4.0 * np.sqrt(0.035 / 500)
    assert np.isnan(median_interval([1.0, 2.0, 3.0, np.nan])[1])


def test_an_interval_of_a_share_solves_wilsons_equation():
    share, low, high = share_interval(7, 20)
    for p in (low, high):
        z = (share - p) / np.sqrt(p * (1.0 - p) / 20)
        assert abs(z) == pytest.approx(norm.ppf(0.975), rel=1e-6)


def test_a_report_says_what_failed_and_is_of_one_file(tmp_path, file):
    rows = [*many(0.5), row("sphere", 17, "random", "", "0") | {"ended": "it exceeded its time"}]
    study = read_study(file)
    study.varied.pop("tolerance")
    write_report(study, TEXT, rows, tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "it exceeded its time" in page and "95 % error / tolerance" in page
    assert not re.findall(r'(?:src|href)="(?!data:)', page) and page.count("<img") == 3
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")


def test_a_picture_of_medians_has_a_bar_of_colours_where_a_run_met_alone(file):
    study = read_study(file)
    study.varied.pop("tolerance")
    for rows, count in ((many(0.5), 2), ([one | {"met": "0"} for one in many(0.5)], 1)):
        figure = pictures(study, rows)["objects"]
        assert len(figure.axes) == count
    assert {text.get_text() for text in figure.axes[0].texts} == {"not met"}


def test_limits_of_the_command_count_more_than_those_of_the_file(file):
    from touchatlas.sim.study.study_file import with_limits

    study = read_study(file)
    assert with_limits(study, WorkOptions()).cell_seconds == 60.0
    assert with_limits(study, WorkOptions(cell_seconds=5.0)).cell_seconds == 5.0


def test_the_same_options_give_the_touches_of_explore():
    """Every flag of touchatlas explore is one of a study."""
    from touchatlas.sim.folder.option_tables import flag_of, options_of
    from touchatlas.sim.study.study_file import _option

    for option in options_of(RunOptions()):
        # A flag is a column where it varies.
        flag = flag_of(option.name).removeprefix("--").replace("-", "_")
        assert flag not in (*FIGURES, *TIMED) and option.name not in (*FIGURES, *TIMED)
        if option.name != "seed":
            assert _option("f", "w", flag_of(option.name)) == option.name
