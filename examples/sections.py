"""Sections of a body nobody built in, against screened Poisson on the same points and our normals.

    python examples/sections.py [MESH ...]

A MESH is a file, or one in the folder TOUCHATLAS_OBJECTS. Its sections have a noise of 2e-4 of the
diagonal: three families of planes, twelve parallel slices, one long spiral, and contour sets of the
kinds of papers on cross-sections, twelve planes through one axis (Liu and others, "Surface
reconstruction from non-parallel curve networks", 2008) and thirty planes anywhere (Bermano and
others, "Online reconstruction of 3D objects from arbitrary cross-sections", 2011). One of the
bodies has a hole, as those of Zou and others, "Topology-constrained surface reconstruction from
cross-sections", 2015. Poisson takes the points with the normals of our samples; of depths 7 and 8
the better one counts (the extra ``peers``). Errors are those of the truth to the surface, in
tolerances of 2e-3 of the diagonal.
"""

import os
import sys
import time
from pathlib import Path

# Read when numpy is loaded.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

import igl
import numpy as np
import trimesh

from touchatlas.atlas import Atlas, Scan, doubts, extract_surface
from touchatlas.planner import Planner
from touchatlas.sim import EvaluateOptions, evaluate_surface, make_object, truth_of

FOLDER = Path(
    os.environ.get("TOUCHATLAS_OBJECTS", Path(__file__).parents[2] / "shared" / "objects")
)
DEFAULT = "lemon_ycb.ply", "spot.ply", "bracket_made.ply", "torus_ode.ply"
NOISE, TOLERANCE, STEP = 2e-4, 2e-3, 5e-3
HEAD = (
    "| body | sections | curves | points | seconds | Poisson seconds | within | p95 | Poisson p95 "
    "| ratio | calibration | predicted | met | doubts |"
)


def sections(mesh, origins, normal, step: float) -> list[np.ndarray]:
    """Closed sections of a mesh in parallel planes, sampled evenly."""
    found = []
    for origin in origins:
        cut = mesh.section(plane_origin=origin, plane_normal=normal)
        for line in [] if cut is None else cut.discrete:
            found.append(evenly(np.asarray(line), step))
    return [line for line in found if len(line) > 8]


def evenly(line, step: float) -> np.ndarray:
    """Points a step apart along a polyline (n, 3)."""
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
    at = np.arange(0.0, along[-1], step)
    return np.stack([np.interp(at, along, column) for column in line.T], axis=1)


def three_families(mesh, step: float) -> list[np.ndarray]:
    """Sections in three families of thirteen planes, across the axes."""
    low, high = mesh.bounds
    places = low + np.linspace(0.04, 0.96, 13)[:, None] * (high - low)
    return [line for axis in np.eye(3) for line in sections(mesh, places, axis, step)]


def slices(mesh, step: float) -> list[np.ndarray]:
    """Twelve parallel slices across the longest axis."""
    low, high = mesh.bounds
    axis = np.eye(3)[(high - low).argmax()]
    places = low + np.linspace(0.02, 0.98, 12)[:, None] * (high - low)
    return sections(mesh, places, axis, step)


def spiral(mesh, step: float) -> list[np.ndarray]:
    """One spiral of forty turns about the longest axis: rays from outside meet the body."""
    low, high = mesh.bounds
    order = np.argsort(high - low)[::-1]
    size = high - low
    turns = 40
    count = int(turns * np.pi * size[order[1]] / step)
    t = np.linspace(0.01, 0.99, count)
    angle = 2.0 * np.pi * turns * t
    outward, far = np.zeros((count, 3)), float(np.linalg.norm(size))
    outward[:, order[1]], outward[:, order[2]] = np.cos(angle), np.sin(angle)
    middle = np.tile(mesh.bounds.mean(axis=0), (count, 1))
    middle[:, order[0]] = low[order[0]] + t * size[order[0]]
    tree, begin = igl.AABB(), middle + far * outward
    # Rays of the tree are in single precision, which suits a diagonal of a thousand.
    scaled, faces = 1e3 / far * mesh.vertices, mesh.faces
    tree.init(scaled, faces)
    away = tree.intersect_ray_first(scaled, faces, 1e3 / far * begin, -outward)[1] * far / 1e3
    points = (begin - away[:, None] * outward)[np.isfinite(away)]
    # The ray jumps where the body has a limb: another curve begins there.
    jump = np.linalg.norm(np.diff(points, axis=0), axis=1) > 6.0 * step
    return [line for line in np.split(points, np.flatnonzero(jump) + 1) if len(line) > 8]


def through_axis(mesh, step: float) -> list[np.ndarray]:
    """Sections in twelve planes through the middle along the longest axis."""
    size, middle = np.ptp(mesh.bounds, axis=0), mesh.bounds.mean(axis=0)
    _, second, third = np.eye(3)[np.argsort(-size)]
    # No plane is one of symmetry.
    angles = np.pi * (np.arange(12) + 0.3) / 12
    normals = np.cos(angles)[:, None] * second + np.sin(angles)[:, None] * third
    return [line for normal in normals for line in sections(mesh, [middle], normal, step)]


def anywhere(mesh, step: float) -> list[np.ndarray]:
    """Sections in thirty planes of any direction through places within half of the size."""
    rng, found = np.random.default_rng(0), []
    size, middle = np.ptp(mesh.bounds, axis=0), mesh.bounds.mean(axis=0)
    for _ in range(30):
        normal = rng.normal(size=3)
        origin = middle + rng.uniform(-0.25, 0.25, 3) * size
        found += sections(mesh, [origin], normal / np.linalg.norm(normal), step)
    return found


KINDS = {
    "three families": three_families,
    "12 slices": slices,
    "spiral": spiral,
    "through one axis": through_axis,
    "anywhere": anywhere,
}


def poisson(points, normals, depth: int):
    """Screened Poisson of pymeshlab (Kazhdan and Hoppe 2013)."""
    import pymeshlab

    work = pymeshlab.MeshSet()
    work.add_mesh(pymeshlab.Mesh(points, v_normals_matrix=normals))
    work.generate_surface_reconstruction_screened_poisson(depth=depth, preclean=True, threads=1)
    mesh = work.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def compared(name: str, mesh, obj, kind: str, rng) -> str:
    """One row of the table."""
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    noise, tolerance = NOISE * diagonal, TOLERANCE * diagonal
    curves = KINDS[kind](mesh, STEP * diagonal)
    points = np.concatenate(curves)
    points = points + rng.normal(0.0, noise, points.shape)
    numbers = np.repeat(np.arange(len(curves)), [len(line) for line in curves])
    start = time.process_time()
    atlas = Atlas(tolerance, scale=5.0 * noise)
    # A spiral is open; a point above the body tells its outer side.
    top = points[points[:, 2].argmax()] + [0.0, 0.0, 0.05 * diagonal]
    change = atlas.add(Scan(points, noise, curves=numbers, outside=top))
    if change.refused:
        return f"| {name} | {kind} | {len(curves)} | {len(points)} | refused: {change.refused} |"
    surface = extract_surface(atlas)
    seconds = time.process_time() - start
    forecast = Planner(points[0], (0.0, 0.0, 1.0)).forecast(atlas)
    truth = truth_of(obj, tolerance, rng, EvaluateOptions(samples=20000))
    columns = surface.vertices, surface.faces
    ours = evaluate_surface(*columns, truth, tolerance, rng, surface.deviation)
    best, peer_seconds = np.inf, np.nan
    for depth in (7, 8):
        start = time.process_time()
        found = poisson(atlas.pool.points, atlas.pool.normals, depth)
        took = time.process_time() - start
        error = evaluate_surface(*found, truth, tolerance, rng).completeness_p95
        if error < best:
            best, peer_seconds = error, took
    said = ", ".join(sorted({doubt.name for doubt in doubts(atlas, surface, forecast.open_places)}))
    met = max(ours.accuracy_p95, ours.completeness_p95) <= tolerance
    return (
        f"| {name} | {kind} | {len(curves)} | {len(points)} | {seconds:.1f} | {peer_seconds:.1f} "
        f"| {ours.coverage:.3f} | {ours.completeness_p95 / tolerance:.3f} "
        f"| {best / tolerance:.3f} | {ours.completeness_p95 / best:.2f} "
        f"| {ours.deviation_calibration:.3f} | {forecast.predicted_coverage:.3f} "
        f"| {'yes' if met else 'no'} | {said or 'none'} |"
    )


def main() -> None:
    """Print the table."""
    print(HEAD)
    print("|" + "---|" * HEAD.count(" | ") + "---|")
    for word in sys.argv[1:] or DEFAULT:
        path = Path(word) if Path(word).is_file() else FOLDER / word
        mesh, obj = trimesh.load_mesh(path), make_object(str(path))
        for kind in KINDS:
            print(compared(path.stem, mesh, obj, kind, np.random.default_rng(0)), flush=True)


if __name__ == "__main__":
    main()
