"""Any file is read, or refused in one sentence: the mutations of examples/fuzz_files.py, drawn by
Hypothesis, which hands back the smallest input that fails."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

EXAMPLE = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "fuzz_files.py"))
KINDS = ("csv", "mesh", "journal", "atlas", "toml")
MESHES = st.sampled_from(EXAMPLE["MESHES"])


@pytest.fixture(scope="module")
def fuzzer(tmp_path_factory):
    """Good files of a run of two touches."""
    return EXAMPLE["Fuzzer"](tmp_path_factory.mktemp("fuzz"))


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_read_or_refused_in_one_sentence(fuzzer, kind):
    @settings(max_examples=50, derandomize=True, deadline=None)
    @given(st.integers(0, 2**32))
    def holds(seed):
        data = fuzzer.make(kind, np.random.default_rng(seed))
        assert EXAMPLE["judge"](fuzzer, kind, data) is None

    holds()


@pytest.mark.parametrize("kind", KINDS)
def test_any_bytes_are_read_or_refused_in_one_sentence(fuzzer, kind):
    @settings(max_examples=30, derandomize=True, deadline=None)
    @given(st.binary(max_size=200), MESHES)
    @example(b"", "ply")
    @example(b"\xff\xfe", "stl")
    def holds(data, ending):
        whole = f"{ending}:".encode() + data if kind == "mesh" else data
        assert EXAMPLE["judge"](fuzzer, kind, whole) is None

    holds()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["csv", "mesh"])
def test_ten_thousand_damaged_files_take_five_seconds_and_a_gibibyte_at_most(
    tmp_path, monkeypatch, kind
):
    monkeypatch.chdir(tmp_path)
    assert EXAMPLE["main"](10_000, 1, [kind]) == 0


def test_the_judge_sees_other_exceptions_and_files_that_are_written(fuzzer, monkeypatch):
    """The tests above can fail."""

    def crashes(*_):
        raise KeyError("z")

    def writes(kind, data, work):
        (work / "left.npz").write_bytes(data)

    monkeypatch.setattr(fuzzer, "read", crashes)
    assert EXAMPLE["judge"](fuzzer, "csv", b"") == "KeyError: 'z'"
    monkeypatch.setattr(fuzzer, "read", writes)
    assert EXAMPLE["judge"](fuzzer, "csv", b"") == "wrote {'left.npz'}"
