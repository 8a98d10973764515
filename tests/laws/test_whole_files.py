"""Atlas and planner files: both kinds are refused in the same words, each with its own advice."""

import json
from pathlib import Path

import numpy as np
import pytest

from touchatlas.atlas import Atlas, load_atlas, save_atlas
from touchatlas.planner import Planner, load_planner, save_planner


def write_atlas(path: Path) -> None:
    save_atlas(path, Atlas(0.1))


def write_planner(path: Path) -> None:
    save_planner(path, Planner([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]))


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
    "planner": (write_planner, load_planner, "one that save_planner wrote", other_planner),
}


@pytest.mark.parametrize("name", KINDS)
def test_what_is_no_whole_file_is_refused_in_the_same_words(name, tmp_path):
    write, load, wanted, other = KINDS[name]
    for path, words in ((3, "got int for the path"), (tmp_path, "is a folder or device")):
        with pytest.raises(ValueError, match=f"{words}; give {wanted}$"):
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
