"""Hashes of what explorations leave behind: a pure move of code changes none of them.

Each object is explored with seed 0. One row each: short hashes of the journal, of the patches in
the saved atlas and of the surface, then how good the surface is and the seconds of processor time.

    python examples/same_bytes.py [OBJECT[:TOUCHES] ...]

OBJECT is built in, or a mesh in the folder TOUCHATLAS_OBJECTS.
"""

import hashlib
import os
import sys
import tempfile
import time
from pathlib import Path

from touchatlas.atlas.store import load_atlas
from touchatlas.sim.run.exploration import RunOptions, run_exploration
from touchatlas.sim.world.objects import make_object, object_names

FOLDER = os.environ.get("TOUCHATLAS_OBJECTS", Path(__file__).parents[2] / "shared" / "objects")
OBJECTS = "bottle", "torus", "cube", "blob", "lemon_ycb:60"
HEAD = (
    "| object | journal | patches | surface | number | coverage | p95 / tolerance | calibration "
    "| chi (true) | touches | seconds |"
)


def short(*parts: bytes) -> str:
    """Ten hexadecimal digits of the SHA-256 of some bytes."""
    return hashlib.sha256(b"".join(parts)).hexdigest()[:10]


def patches_bytes(path: Path) -> bytes:
    """Frames, radii, coefficients and covariances of the patches of a saved atlas."""
    atlas = load_atlas(path)
    patches = [atlas.patch(i) for i in sorted(atlas.graph)]
    columns = (
        (p.frame.origin, p.frame.axes, p.polynomial.coefficients, p.covariance) for p in patches
    )
    return b"".join(column.tobytes() for patch in columns for column in patch)


def row(name: str) -> str:
    """Explore, and format one line."""
    name, _, most = name.partition(":")
    obj = make_object(name if name in object_names() else f"{Path(FOLDER, name)}.ply")
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        options = RunOptions(max_touches=int(most) if most else None)
        n = run_exploration(obj, folder, options).numbers
        seconds = time.process_time() - start
        journal, surface = (Path(folder, file) for file in ("journal.sqlite", "surface.ply"))
        hashes = short(journal.read_bytes()), short(patches_bytes(Path(folder, "atlas.npz")))
        last = short(surface.read_bytes()) if surface.exists() else "none"
    return (
        f"| {obj.name} | {hashes[0]} | {hashes[1]} | {last} | {n['patches']} | {n['coverage']:.4f} "
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
