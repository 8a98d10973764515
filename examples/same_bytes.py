"""Hashes of what explorations leave behind: a pure move of code changes none of them.

Each object is explored with seed 0. One row each: short hashes of the journal, of the saved atlas
and of the surface, then how good the surface is and the seconds of processor time.

    python examples/same_bytes.py [OBJECT[:TOUCHES] ...]

OBJECT is built in, or a mesh in the folder TOUCHATLAS_OBJECTS.
"""

import hashlib
import os
import sys
import tempfile
import time
from pathlib import Path

from touchatlas.sim.run.exploration import RunOptions, run_exploration
from touchatlas.sim.world.objects import make_object, object_names

FOLDER = os.environ.get("TOUCHATLAS_OBJECTS", Path(__file__).parents[2] / "shared" / "objects")
OBJECTS = "bottle", "torus", "cube", "blob", "lemon_ycb:60"
HEAD = (
    "| object | journal | atlas | surface | patches | coverage | p95 / tolerance | calibration "
    "| chi (true) | touches | seconds |"
)


def short(path: Path) -> str:
    """Ten hexadecimal digits of the SHA-256 of a file; "none" where there is none."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:10] if path.exists() else "none"


def row(name: str) -> str:
    """Explore, and format one line."""
    name, _, most = name.partition(":")
    obj = make_object(name if name in object_names() else f"{Path(FOLDER, name)}.ply")
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        options = RunOptions(max_touches=int(most) if most else None)
        n = run_exploration(obj, folder, options).numbers
        seconds = time.process_time() - start
        files = "journal.sqlite", "atlas.npz", "surface.ply"
        hashes = " | ".join(short(Path(folder, file)) for file in files)
    return (
        f"| {obj.name} | {hashes} | {n['patches']} | {n['coverage']:.4f} "
        f"| {n['completeness_p95'] / n['tolerance']:.4f} | {n['deviation_calibration']:.3f} "
        f"| {n['euler_characteristic']} ({n['true_euler_characteristic']}) | {n['touches']} "
        f"| {seconds:.1f} |"
    )


def main(*names: str) -> None:
    print(HEAD)
    print("|" + "---|" * (HEAD.count("|") - 1))
    for name in names or OBJECTS:
        print(row(name), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
