"""How near the triangles of finished runs are to the surface, and how many they are.

touchatlas explore bottle && python examples/triangles.py runs/bottle-0

Each row: triangles, bytes of surface.ply, seconds of processor time, and the distance of points of
the triangles from the surface of faces, in tolerances: the 99.9 % quantile and the largest. The
points are the vertices, the middles of the sides, the centres, and 100,000 random ones.
"""

import sys
import time
from pathlib import Path

import numpy as np
import trimesh

from touchatlas.atlas import Atlas, Surface, extract_surface, load_atlas
from touchatlas.sim.folder.ply import ply_bytes

HEAD = "| run | triangles | bytes | seconds | off 99.9 % | off, largest | watertight | chi |"


def off_the_surface(atlas: Atlas, surface: Surface, count: int = 100_000) -> np.ndarray:
    """Distances of points of the triangles from the surface of faces, in tolerances."""
    rng = np.random.default_rng(0)
    corners = surface.vertices[surface.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.sqrt((across**2).sum(axis=1))
    some = rng.choice(len(area), count, p=area / area.sum())
    points = np.einsum("nk,nkd->nd", rng.dirichlet(np.ones(3), count), corners[some])
    sides = 0.5 * (corners + np.roll(corners, -1, axis=1)).reshape(-1, 3)
    seen = atlas.blend(np.concatenate([surface.vertices, sides, corners.mean(axis=1), points]))
    return np.abs(seen.distance[seen.known]) / atlas.tolerance


def row(run: str) -> str:
    """Extract the surface of a run and format one line."""
    atlas = load_atlas(Path(run) / "atlas.npz")
    start = time.process_time()
    surface = extract_surface(atlas)
    seconds = time.process_time() - start
    off = off_the_surface(atlas, surface)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    return (
        f"| {Path(run).name} | {len(surface.faces):,} "
        f"| {len(ply_bytes(surface, atlas.tolerance)):,} | {seconds:.2f} "
        f"| {np.quantile(off, 0.999):.3f} | {off.max():.3f} "
        f"| {'yes' if mesh.is_watertight else 'no'} | {mesh.euler_number} |"
    )


def main(*runs: str) -> None:
    if not runs:
        print("give folders of runs; see the first lines of this file")
        return
    print(HEAD)
    print("|" + "---|" * (HEAD.count("|") - 1))
    for run in runs:
        print(row(run), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
