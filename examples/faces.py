"""Faces of an object from touches: how many, which kinds, how well told apart, how good the rims.

With TOUCHES these are spread over the true surface. Without, or with 0, the object is explored as
`touchatlas explore OBJECT --seed SEED --max-touches 150` does.

    python examples/faces.py OBJECT [TOUCHES] [SEED]

OBJECT is a built-in object, a mesh file, or one of step, wall and roof.
"""

import sys
import time
from collections import Counter

import numpy as np
import trimesh
from scipy.optimize import linear_sum_assignment

from touchatlas.atlas import Atlas, Faces, extract_surface, face_values
from touchatlas.planner import ProbePlan, Reason, explore
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim import Probe, RunOptions, make_object
from touchatlas.sim.run.work import begin, random_streams
from touchatlas.sim.study.surface_peers import spread
from touchatlas.sim.world.implicit_fields import polyhedron, union
from touchatlas.sim.world.implicit_object import ImplicitObject

MOST_TOUCHES = 150
INNER, FILLET = np.array([45.0, 25.0, 5.0]), 5.0
SLOPE = np.array([np.sin(np.deg2rad(25.0)), 0.0, np.cos(np.deg2rad(25.0))])
SIDES = np.concatenate([np.eye(3), -np.eye(3)])
# Normals and levels of the planes, a body of their half spaces or boxes, and half its extent.
BODIES = {
    "cube": (SIDES, [30.0] * 6, (30, 30, 30)),
    "wall": (SIDES, [20, 20, 3, 20, 20, 3], (20, 20, 3)),
    "roof": (
        np.concatenate([[SLOPE, SLOPE * [-1, 1, 1]], SIDES[[0, 1, 3, 4, 5]]]),
        [10 * SLOPE[2], 10 * SLOPE[2], 25, 25, 25, 25, 20],
        (25, 25, 20),
    ),
    "step": (np.concatenate([SIDES, SIDES[[0, 2]]]), [30, 20, 15, 30, 20, 20, 0, 0], (30, 20, 20)),
}


def body(name: str):
    """The object of a name."""
    if name not in BODIES or name == "cube":
        return make_object(name)
    normals, levels, half = BODIES[name]
    field = polyhedron(normals, levels)
    if name == "step":
        high = polyhedron(SIDES, [0, 20, 15, 30, 20, 20])
        field = union(polyhedron(SIDES, [30, 20, 0, 30, 20, 20]), high)
    return ImplicitObject(name, "", field, half, 0.02, 0.1)


def spread_atlas(obj, count: int, seed: int) -> Atlas:
    """An atlas of touches spread over the object, as long as the planner would make them."""
    rng = np.random.default_rng(seed)
    probe, atlas = Probe(obj, obj.noise_std, rng), Atlas(obj.tolerance)
    points, normals = obj.sample(20 * count, rng)
    for number, i in enumerate(spread(points, count)):
        bend = 0.0
        if hasattr(obj, "principal_curvatures"):
            k1, k2, _ = obj.principal_curvatures(points[i : i + 1])
            bend = max(abs(k1[0]), abs(k2[0]))
        reach = np.clip(np.pi / 4 / max(bend, 1e-9), 60 * obj.tolerance, 200 * obj.tolerance)
        planes = concurrent_planes(points[i], normals[i], rng.normal(size=3), 3)
        plan = ProbePlan(
            number, points[i], normals[i], planes, reach, reach / 12, np.pi / 4, Reason.EXPAND
        )
        atlas.add(probe(plan))
    return atlas


def explored_atlas(obj, seed: int) -> Atlas:
    """The atlas of `touchatlas explore`, finished."""
    probe_rng, *_, planner_rng = random_streams(seed)
    atlas, planner = begin(RunOptions(obj.noise_std, obj.tolerance), obj, planner_rng)
    for _ in explore(atlas, planner, Probe(obj, obj.noise_std, probe_rng), MOST_TOUCHES):
        pass
    atlas.finish()
    return atlas


def true_pieces(name: str, obj, points):
    """(n,) number of the true piece of each point, or None where none is known."""
    if name == "plate":
        block = np.where(np.abs(points) > INNER, np.sign(points), 0).astype(int)
        return (block + 1) @ [9, 3, 1]
    if name not in BODIES:
        return None
    on = obj.project(points)
    normals = obj.normal(on)
    keys = np.column_stack([normals, (on * normals).sum(axis=1)]).round(2)
    return np.unique(keys, axis=0, return_inverse=True)[1].ravel()


def edges_counted(faces: Faces) -> np.ndarray:
    """(n,) face of each sample; edges and corners, which have samples on their balls, are counted
    on from the faces."""
    of = faces.of.copy()
    for number, part in enumerate((*faces.edges, *faces.corners), len(faces)):
        of[part.samples] = number
    return of


def rim_errors(name: str, points) -> np.ndarray:
    """(m,) distances of points of edges from the true ones; none where these are not known."""
    if name not in (*BODIES, "plate"):
        return np.zeros(0)
    normals, levels, _ = BODIES.get(name, (SIDES, [*INNER + FILLET] * 2, ()))
    heights = np.sort(np.abs(points @ np.transpose(normals) - levels), axis=1)
    off = np.hypot(heights[:, 0], heights[:, 1])
    # The plate has the rims of its fillets, or edges that are rounded.
    rims = np.abs(heights - FILLET).min(axis=1)
    return np.minimum(off, rims) if name == "plate" else off


def right_and_found(truth, of) -> tuple[float, int]:
    """Fraction of samples in the right face, one to one, and how many pieces are found: more than
    half of a piece in a face that is more than half of it."""
    names, piece = np.unique(truth, return_inverse=True)
    table = np.zeros((of.max() + 1, len(names)))
    np.add.at(table, (of[of >= 0], piece[of >= 0]), 1)
    a, b = linear_sum_assignment(-table)
    common = table[a, b]
    found = (2 * common > table.sum(axis=0)[b]) & (2 * common > table.sum(axis=1)[a])
    return float(common.sum() / len(of)), int(found.sum())


def print_edges(name: str, faces: Faces) -> None:
    """Print the radii of rounded edges, and how far all edges are off where that is known."""
    if radii := [edge.radius for edge in faces.edges if edge.radius]:
        print(f"{len(radii)} edges with radii of {min(radii):.3f} to {max(radii):.3f}")
    curves = [curve for edge in faces.edges for curve in edge.curves]
    errors = rim_errors(name, np.concatenate(curves)) if curves else np.zeros(0)
    if len(errors):
        print(f"edges off by {np.median(errors):.4f}, 95 % {np.quantile(errors, 0.95):.4f}")


def compare_fields(obj, atlas: Atlas, faces: Faces) -> None:
    """Print the distances of true points by the faces, and by the surface where it is known."""
    points, _ = obj.sample(10000, np.random.default_rng(99))
    blend = atlas.blend(points)
    for what, distance in (
        ("faces", face_values(faces, points).distance),
        ("surface", blend.distance[blend.known]),
    ):
        off = np.abs(distance)
        tail = "95 % {:.4f}, 99.9 % {:.4f}".format(*np.quantile(off, [0.95, 0.999]))
        print(f"{what}: {len(off) / len(points):.3f} known, mean {off.mean():.4f}, {tail}")


def main(name: str, touches: str = "", seed: str = "0") -> None:
    obj = body(name)
    count = int(touches or 0)
    atlas = spread_atlas(obj, count, int(seed)) if count else explored_atlas(obj, int(seed))
    start = time.process_time()
    faces = atlas.faces()
    seconds = time.process_time() - start
    patches = sum(len(face.pieces) for face in faces.faces)
    print(f"{name}: {atlas.touches} touches, {len(faces.points)} samples")
    print(f"{len(faces)} faces of {patches} patches, {faces.unexplained:.2%} unexplained", end="")
    print(f", {seconds:.1f} s; edges: {dict(Counter(e.kind.value for e in faces.edges))}")
    truth = true_pieces(name, obj, faces.points)
    if truth is not None:
        right, found = right_and_found(truth, edges_counted(faces))
        print(f"right {right:.4f}, found {found} of {len(np.unique(truth))}")
    print_edges(name, faces)
    compare_fields(obj, atlas, faces)
    surface = extract_surface(atlas)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    print(f"watertight {mesh.is_watertight}, Euler characteristic {mesh.euler_number}, ", end="")
    print(f"total curvature / 2 pi {surface.total_curvature() / (2 * np.pi):.4f}")
    for face in faces.faces[:30]:
        print(f"  {face.id}: {face.words}; {len(face.samples)} samples, rms {face.deviation:.2g}")


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["sphere", "12"]))
