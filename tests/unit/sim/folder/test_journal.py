"""The journal and the options on what they are not made for: one sentence each."""

import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, PlannerOptions
from touchatlas.sim import Probe, make_object
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.run_options import RunOptions, check_effort, fit_scale


@pytest.fixture
def path(tmp_path):
    return tmp_path / "journal.sqlite"


def touches_of_a_ball(count=1):
    """Plans of a ball, the touches that answer them, and the state of the probe after each."""
    ball, atlas = make_object("sphere"), Atlas(0.5)
    probe, planner = Probe(ball, 0.02, np.random.default_rng(0)), Planner(*ball.start())
    for _ in range(count):
        plan = planner.ask(atlas)
        touch = probe(plan)
        yield plan, touch, probe.state()
        planner.tell(touch, atlas.add(touch))


def altered(path, change):
    with closing(sqlite3.connect(path)) as journal:
        journal.execute(change)
        journal.commit()


def test_what_is_no_journal_is_refused(tmp_path):
    (tmp_path / "junk").write_bytes(b"junk" * 300)
    altered(tmp_path / "other.db", "create table mine (a)")
    for name in ("junk", "other.db"):
        before = (tmp_path / name).read_bytes()
        with pytest.raises(ValueError, match=f"{name} is no whole journal of a run"):
            Journal(tmp_path / name)
        assert (tmp_path / name).read_bytes() == before
    with pytest.raises(ValueError, match="is no file; give the journal.sqlite"):
        Journal(tmp_path)
    with pytest.raises(ValueError, match="nowhere is no folder"):
        Journal(tmp_path / "nowhere" / "journal.sqlite")
    with pytest.raises(ValueError, match="got NoneType for the path; give the journal.sqlite"):
        Journal(None)


def test_only_the_next_touch_is_written(path):
    """A touch written twice, or after a gap, would make a journal that nobody can read."""
    [(plan, touch, _)] = touches_of_a_ball()
    with closing(Journal(path)) as journal:
        for wrong in ((None, touch), (plan, None)):
            with pytest.raises(ValueError, match="give a ProbePlan and the Touch"):
                journal.append(*wrong)
        with pytest.raises(ValueError, match=r"touch 1 is not the next one .* which holds 0"):
            journal.append(replace(plan, number=1), replace(touch, number=1))
        with pytest.raises(ValueError, match="touch 0 does not answer plan 1; give the ProbePlan"):
            journal.append(replace(plan, number=1), touch)
        journal.append(plan, touch)
        with pytest.raises(ValueError, match=r"touch 0 is not the next one .* go on with number 1"):
            journal.append(plan, touch)
        assert len(journal.touches()) == 1


def test_a_journal_that_is_closed_or_locked_is_not_called_damaged(path, monkeypatch):
    monkeypatch.setattr(sqlite3, "connect", partial(sqlite3.connect, timeout=0.01))
    with closing(Journal(path)) as journal:
        with closing(sqlite3.connect(path, isolation_level=None)) as other:
            other.execute("begin exclusive")
            with pytest.raises(sqlite3.OperationalError, match="locked"):
                journal.touches()
        assert journal.touches() == []
    with pytest.raises(sqlite3.ProgrammingError, match="closed"):
        journal.touches()


@pytest.mark.parametrize(
    "change",
    [
        "update touch set number = 7 where number = 1",
        "update touch set status = 'odd'",
        "update touch set contact = x'00'",
        "update touch set approach = null",
        "update contour set points = 'text'",
        "update contour set noise_std = -1.0",
        "update way set ends = x'00'",
        "update way set touch = 99 where touch = 1",
        "drop table contour",
    ],
)
def test_an_altered_journal_is_refused(path, change):
    with closing(Journal(path)) as journal:
        for entry in touches_of_a_ball(2):
            journal.append(*entry)
        assert len(journal.entries()) == 2
    altered(path, change)
    with pytest.raises(ValueError, match="is no whole journal of a run"):
        Journal(path).entries()


def test_ways_come_back_and_journals_of_earlier_versions_have_none(path):
    [(plan, touch, _)] = touches_of_a_ball()
    assert touch.way is not None
    with closing(Journal(path)) as journal:
        journal.append(plan, touch)
        journal.append(replace(plan, number=1), replace(touch, number=1, way=None))
        one, other = journal.touches()
        assert (one.way == touch.way).all() and other.way is None
    altered(path, "drop table way")
    with closing(Journal(path)) as journal:
        assert [one.way for one in journal.touches()] == [None, None]


def test_the_settings_of_the_touches_are_kept_as_they_are(path):
    settings = {"seed": np.int64(3), "noise": 0.1 + 0.2, "atlas.facets": np.inf, "object": "cube"}
    with closing(Journal(path)) as journal:
        assert journal.settings() == {}
        journal.keep_settings(settings)
        assert journal.settings() == settings
    before = path.read_bytes()
    with closing(Journal(path)) as journal:
        journal.keep_settings(settings)
    assert path.read_bytes() == before
    altered(path, "update setting set value = 'odd' where name = 'seed'")
    with (
        closing(Journal(path)) as journal,
        pytest.raises(ValueError, match="is no whole journal of a run"),
    ):
        journal.settings()


def test_touches_of_millions_of_samples_are_refused():
    with pytest.raises(ValueError, match="makes 2.1e.04 samples a touch"):
        check_effort(PlannerOptions(step=1.7e-4))
    check_effort(PlannerOptions())


def test_the_scale_of_fits_follows_the_noise_and_not_the_tolerance():
    assert fit_scale(0.02, 200.0) == pytest.approx(0.1)
    assert fit_scale(0.0, 200.0) == pytest.approx(0.04)


@pytest.mark.parametrize(
    "values",
    [{"seed": "a"}, {"seed": 1.5}, {"max_touches": 2.5}, {"tolerance": None, "noise": True}],
)
def test_options_of_other_types_are_refused(values):
    with pytest.raises(ValueError, match="must be a (whole|finite) number"):
        RunOptions(**values)
    assert RunOptions(seed=np.int64(3), noise=np.float32(0.5)).seed == 3


def test_a_journal_that_several_open_at_once_is_made_once(tmp_path):
    """Without waiting for each other every second opening failed: the table was there already."""
    with ThreadPoolExecutor(4) as pool:
        for number in range(10):
            path = tmp_path / f"{number}.sqlite"
            for journal in [pool.submit(lambda p=path: Journal(p).close()) for _ in range(4)]:
                journal.result()
            with closing(Journal(path)) as made:
                assert len(made) == 0


def test_a_journal_keeps_tips_and_measured_normals(path):
    [(plan, touch, _)] = touches_of_a_ball()
    first, *others = touch.contours
    normals = first.points / np.linalg.norm(first.points, axis=1)[:, None]
    contours = (replace(first, normals=normals), *others)
    given = replace(touch, contours=contours, tip_radius=2.0, systematic_std=0.005)
    with closing(Journal(path)) as journal:
        journal.append(plan, given)
        [held] = journal.touches()
    assert (held.tip_radius, held.systematic_std) == (2.0, 0.005)
    assert np.array_equal(held.contours[0].normals, normals)
    assert all(contour.normals is None for contour in held.contours[1:])
