"""Option records as flags, files and names of folders: nothing is rounded, and nothing is lost."""

from dataclasses import dataclass, replace

import pytest

from tests.command import assert_refused, ran, touchatlas
from touchatlas.planner import PlannerOptions
from touchatlas.sim.command.explore import default_folder
from touchatlas.sim.folder.option_tables import (
    as_table,
    differences,
    nested,
    options_of,
    read_options,
    updated,
)
from touchatlas.sim.folder.run_folder import _toml
from touchatlas.sim.folder.run_options import RunOptions

OTHER = RunOptions(noise=0.5, max_touches=7, seed=2, planner=PlannerOptions(curves=5, max_turn=0.5))


def test_every_field_is_an_option_with_a_meaning():
    found = {option.name: option for option in options_of(RunOptions())}
    assert {"noise", "seed", "planner.curves", "atlas.facets", "atlas.bias"} <= set(found)
    assert all(option.meaning and option.meaning.endswith(".") for option in found.values())
    assert (found["planner.curves"].kind, found["noise"].kind) == (int, float)


@pytest.mark.parametrize("record", [RunOptions(), OTHER])
def test_a_record_comes_back_from_its_file(record, tmp_path):
    path = tmp_path / "run.toml"
    path.write_text('object = "sphere"\n' + _toml(as_table(record)) + '[versions]\na = "1"\n')
    assert read_options(path, RunOptions(), ("object", "versions")) == record


def test_text_in_place_of_a_table_is_the_name_of_its_kind(tmp_path):
    """As it is with flags, where --probe is the name and --probe.feed one of its options."""
    path = tmp_path / "own.toml"
    path.write_text('probe = "trigger"\nplanner = "random"\n')
    found = read_options(path, RunOptions())
    assert (found.probe.name, found.planner.name) == ("trigger", "random")


def test_differences_are_what_was_changed():
    assert differences(OTHER, RunOptions()) == {
        "noise": 0.5,
        "max_touches": 7,
        "seed": 2,
        "planner.curves": 5,
        "planner.max_turn": 0.5,
    }
    assert updated(RunOptions(), nested({("planner", "curves"): 5}), "x").planner.curves == 5


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("curves = 4", "has curves, which is no option; there are noise"),
        ("tolerence = 0.1", "has tolerence, which is no option; did you mean tolerance"),
        ("planner = 3", "planner = 3; it must be a table of options, or text, its name"),
        ("atlas = 'fine'", "atlas = 'fine'; it must be a table of options"),
        (
            "probe = 'wheel'",
            "o.toml: name is 'wheel'; it must be one of ideal, scanning, trigger",
        ),
        ("[planner]\ncurves = 4.0", "planner.curves is 4.0; it must be a whole number"),
        ("[planner]\ncurves = true", "planner.curves is True; it must be a whole number"),
        ("[planner]\ncurves = 1", "curves is 1"),
        ("noise = 'a'", "noise is 'a'; it must be a number"),
        ("noise = ", "cannot be read as TOML"),
        ("noise = -1", "noise is -1"),
        ("[atlas.fit]\ndegree = 4", "has atlas.fit, which is no option; there are bias, facets"),
        ("noise = 1" + "0" * 400, "noise is too large for a number"),
    ],
)
def test_a_wrong_file_is_refused_in_one_sentence(tmp_path, text, words):
    (tmp_path / "o.toml").write_text(text)
    done = touchatlas("explore", "sphere", "--options", "o.toml", cwd=tmp_path)
    assert_refused(done, 2, words)


@pytest.mark.usefixtures("no_pictures")
def test_flags_come_after_the_file_and_both_are_in_run_toml(tmp_path):
    (tmp_path / "o.toml").write_text("tolerance = 0.5\nmax_touches = 5\n[planner]\ncurves = 5\n")
    words = ["--options", "o.toml", "--max-touches", 1, "--atlas.facets", 0.5, "--out", "r"]
    ran("explore", "sphere", *words, cwd=tmp_path)
    found = read_options(tmp_path / "r" / "run.toml", RunOptions(), ("object", "versions"))
    assert (found.tolerance, found.max_touches, found.planner.curves) == (0.5, 1, 5)
    assert found.atlas == replace(RunOptions().atlas, facets=0.5)


def test_runs_of_other_options_have_other_folders():
    folders = {
        default_folder("sphere", options).name
        for options in (
            RunOptions(),
            RunOptions(seed=1),
            RunOptions(tolerance=0.3),
            RunOptions(planner=PlannerOptions(curves=4)),
        )
    }
    assert folders == {
        "sphere-0",
        "sphere-1",
        "sphere-0-tolerance=0.3",
        "sphere-0-planner.curves=4",
    }
    # A larger budget is another part of the same run.
    assert default_folder("sphere", RunOptions(max_touches=9)).name == "sphere-0"
    assert len(default_folder("s" * 300, OTHER).name) == 120


@dataclass(frozen=True)
class Named:
    """A record of two kinds.

    Parameters
    ----------
    one, two : int
        Said
        once.
    three : str
        More.

    Notes
    -----
    four : int
        No option.
    """

    one: int = 1
    two: int = 2
    three: str = "x"


def test_meanings_are_those_of_the_docstring():
    found = {option.name: option.meaning for option in options_of(Named())}
    assert found == {"one": "Said once.", "two": "Said once.", "three": "More."}
