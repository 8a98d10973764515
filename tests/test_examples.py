"""Every example runs as its first lines say."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from touchatlas.atlas import load_atlas
from touchatlas.sim import RunOptions, make_object, run_exploration

EXAMPLES = Path(__file__).parent.parent / "examples"
# Small stand-ins for the arguments that a reader would give.
ARGUMENTS = {
    "cost_of_an_atlas.py": ["30", "60"],
    "time_of_a_touch.py": ["sphere"],
    "table_of_objects.py": ["sphere"],
}


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.py")))
def test_examples_run(name, tmp_path):
    done = subprocess.run(
        [sys.executable, "-W", "error", EXAMPLES / name, *ARGUMENTS.get(name, [])],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=os.environ,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_a_run_whose_patches_were_merged_is_drawn(tmp_path):
    """Numbers of patches that are no more leave holes: there are more numbers than patches."""
    options = RunOptions(None, None, 25, None, 0)
    run_exploration(make_object("sphere", 0), tmp_path / "run", options)
    atlas = load_atlas(tmp_path / "run" / "atlas.npz")
    assert len(atlas) < atlas.table.size
    picture = [EXAMPLES / "picture_of_a_run.py", tmp_path / "run", tmp_path / "run.png"]
    done = subprocess.run(
        [sys.executable, "-W", "error", *picture], capture_output=True, text=True, env=os.environ
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run.png").stat().st_size > 1000
