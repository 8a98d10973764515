"""Atlas and planner files: both kinds are refused in the same words, each with its own advice."""

import hashlib
import json
import re
from pathlib import Path

import numpy as np
import pytest

from touchatlas.atlas import Atlas, load_atlas, save_atlas
from touchatlas.planner import Planner, load_planner, save_planner


def write_atlas(path: Path) -> None:
    save_atlas(path, Atlas(0.1))


def write_planner(path: Path) -> None:
    save_planner(path, Planner([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]), Atlas(0.1))


def read_planner(path) -> Planner:
    return load_planner(path, Atlas(0.1))


def other_atlas(path: Path) -> None:
    """An atlas file of format 99."""
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    header = {**json.loads(arrays["header"].tobytes()), "format": 99}
    with open(path, "wb") as file:
        np.savez(file, **arrays | {"header": np.frombuffer(json.dumps(header).encode(), np.uint8)})


def other_planner(path: Path) -> None:
    """A planner file of format 99."""
    path.write_text(json.dumps({**json.loads(path.read_text()), "format": 99}))


KINDS = {
    "atlas": (write_atlas, load_atlas, "the atlas.npz of a run", other_atlas),
    "planner": (write_planner, read_planner, "one that save_planner wrote", other_planner),
}


@pytest.mark.parametrize("name", KINDS)
def test_what_is_no_whole_file_is_refused_in_the_same_words(name, tmp_path):
    write, load, wanted, other = KINDS[name]
    for path, words in (
        (3, "got int for the path"),
        (tmp_path, "is a folder"),
        ("/dev/zero", "device"),
    ):
        with pytest.raises(ValueError, match=f"{words}.*; give {wanted}$"):
            load(path)
    path = tmp_path / "file"
    with pytest.raises(ValueError, match=f"does not exist; give {wanted}$"):
        load(path)
    write(path)
    load(path)
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(ValueError, match=f"no whole {name} file.*cut off or altered: give another"):
        load(path)
    write(path)
    other(path)
    with pytest.raises(ValueError, match="has format 99; this version reads .*use the version"):
        load(path)


def sentence_of(load, path: Path) -> str:
    """What is said of a file that is refused."""
    with pytest.raises(ValueError) as refused:
        load(path)
    return str(refused.value)


# Words of Python and of libraries that a message must not have.
PYTHON = re.compile(r"[A-Za-z]*Error|NoneType|object|attribute|subscript|keyword|[A-Z]_|__|['{}\[]")


@pytest.mark.parametrize(
    "state",
    [
        "null",
        "3",
        "[]",
        "{}",
        '{"Planner": null}',
        '{"Planner": []}',
        '{"Pickle": []}',
        '{"Planner": [["stop", {"Stop": []}]]}',
        '{"Planner": [["stop", {"Generator": [3]}]]}',
        '{"ndarray": ["<f8", [2], [1.0]]}',
        "[" * 100000,
        "{",
    ],
)
def test_a_damaged_planner_is_refused_in_plain_words(state, tmp_path):
    """Its digest is right, so that what it holds is read."""
    path = tmp_path / "planner"
    write_planner(path)
    good = json.loads(path.read_text())
    number, known = good["format"], good["atlas"]
    both = json.dumps([known, state], sort_keys=True)
    digest = hashlib.sha256(both.encode()).hexdigest()
    for whole in (
        {"format": number, "atlas": known, "sha256": digest, "planner": state},
        {"format": number, "atlas": state, "sha256": digest, "planner": state},
        {"format": number, "atlas": {"counts": state}, "sha256": digest, "planner": state},
        good | {"atlas": known | {"counts": [1, 0]}},
        good | {"atlas": known | {"counts": [10**400, 3]}},
        good | {"atlas": known | {"sha256": "x"}},
        {"format": state, "sha256": "", "planner": None},
        {"format": number, "planner": None},
        [state],
    ):
        path.write_text(json.dumps(whole))
        words = sentence_of(read_planner, path).removeprefix(str(path))
        assert "is no whole planner file" in words and not PYTHON.search(words), words


@pytest.mark.parametrize("name", KINDS)
def test_a_file_that_may_not_be_read_is_not_called_damaged(name, tmp_path, monkeypatch):
    write, load, wanted, _ = KINDS[name]
    write(tmp_path / "file")

    def denied(_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", denied)
    words = f"{tmp_path / 'file'} cannot be read (Permission denied); give {wanted}"
    assert sentence_of(load, tmp_path / "file") == words
