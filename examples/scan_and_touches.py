"""Half a scan and touches as one atlas: how many touches a scan saves.

    python examples/scan_and_touches.py [OBJECT ...]

A camera of 320 x 320 pixels sees each object from one side, with a noise of 1e-3 of the diagonal.
Touches with the usual noise explore the object to its tolerance without the scan, and with it.
*Met* is the touch after which the surface is within the tolerance for the first time: 95 % of the
errors, both ways. Calibration is the share of the surface whose true error is within the predicted
95 %, of the part that the camera saw and of the rest.
"""

import os
import sys
import time
from pathlib import Path

# Read when numpy is loaded.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

import igl
import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas import Atlas, Scan, extract_surface
from touchatlas.planner import Planner, explore
from touchatlas.sim import EvaluateOptions, Probe, evaluate_surface, make_object, truth_of
from touchatlas.sim.folder.run_options import fit_scale
from touchatlas.sim.judge.closest_points import ClosestPoints

FOLDER = Path(
    os.environ.get("TOUCHATLAS_OBJECTS", Path(__file__).parents[2] / "shared" / "objects")
)
DEFAULT = "bottle", "mustard_ycb.ply", "spot.ply", "bracket_made.ply"
# Tolerances of mesh files as fractions of their diagonals, those of the guard.
TOLERANCES = {"mustard_ycb": 1e-2, "spot": 1e-2}
MOST = 90
HEAD = (
    "| object | scan | met | touches | stopped | within | p95 / tolerance | calibration seen "
    "| calibration unseen | seconds |"
)


def half_scan(mesh, diagonal: float, rng) -> Scan:
    """What a camera three diagonals away sees of a mesh, vertices (n, 3) and faces (f, 3)."""
    vertices, faces = mesh
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    toward = np.array([0.8, 0.5, 0.33]) / np.linalg.norm([0.8, 0.5, 0.33])
    eye = middle + 3.0 * diagonal * toward
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    side = np.linspace(-0.55, 0.55, 320) * diagonal
    x, y = (grid.reshape(-1, 1) for grid in np.meshgrid(side, side))
    targets = middle + x * right + y * np.cross(toward, right)
    tree, rays = igl.AABB(), targets - eye
    # Rays of the tree are in single precision, which suits a diagonal of a thousand.
    unit = 1e-3 * diagonal
    tree.init(vertices / unit, faces)
    eyes = np.tile(eye / unit, (len(rays), 1))
    _, distance, _ = tree.intersect_ray_first(vertices / unit, faces, eyes, rays / unit)
    hit = np.isfinite(distance)
    points = eye + distance[hit, None] * rays[hit]
    noise = 1e-3 * diagonal
    return Scan(points + rng.normal(0.0, noise, points.shape), noise, viewpoint=eye)


def explored(name: str, with_scan: bool) -> str:
    """One row of the table."""
    path = Path(name) if Path(name).is_file() else FOLDER / name
    obj = make_object(str(path) if path.is_file() else name, 0)
    label = path.stem if path.is_file() else name
    tolerance = TOLERANCES.get(label, obj.tolerance / obj.diagonal) * obj.diagonal
    rng, start = np.random.default_rng(0), time.perf_counter()
    mesh = obj.mesh(0.05 * tolerance)
    scan = half_scan(mesh, obj.diagonal, rng)
    atlas = Atlas(tolerance, scale=fit_scale(obj.noise_std, obj.diagonal))
    planner = Planner(*obj.start())
    if with_scan:
        assert not atlas.add(scan).refused
    probe, count, met, aside = Probe(obj, obj.noise_std, np.random.default_rng(1)), 0, 0, 0.0
    few, many = (truth_of(obj, tolerance, rng, EvaluateOptions(n)) for n in (4000, 20000))
    for _ in explore(atlas, planner, probe, MOST):
        count, now = count + 1, time.perf_counter()
        if not met and atlas.body is not None:
            surface = extract_surface(atlas)
            found = evaluate_surface(surface.vertices, surface.faces, few, tolerance, rng)
            worst = max(found.completeness_p95, found.accuracy_p95)
            met = count if worst <= tolerance else 0
        aside += time.perf_counter() - now
    atlas.finish()
    surface = extract_surface(atlas)
    seconds = time.perf_counter() - start - aside
    columns = surface.vertices, surface.faces
    found = evaluate_surface(*columns, many, tolerance, rng, surface.deviation)
    error = ClosestPoints(*mesh)(surface.vertices)[0]
    away = cKDTree(scan.points).query(surface.vertices)[0]
    seen = away < 0.03 * obj.diagonal
    right = error <= 1.96 * surface.deviation
    stopped = "at most" if planner.stop is None else planner.stop.reason.value
    return (
        f"| {label} | {'half' if with_scan else 'none'} | {met or 'no'} | {count} | {stopped} "
        f"| {found.coverage:.4f} | {found.completeness_p95 / tolerance:.2f} "
        f"| {right[seen].mean():.3f} | {right[~seen].mean():.3f} | {seconds:.0f} |"
    )


def main() -> None:
    """Print the table."""
    print(HEAD)
    print("|" + "---|" * (HEAD.count(" | ") + 1))
    for name in sys.argv[1:] or DEFAULT:
        for with_scan in (False, True):
            print(explored(name, with_scan), flush=True)


if __name__ == "__main__":
    main()
