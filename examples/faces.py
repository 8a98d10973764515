"""Faces from the same samples: ours beside CGAL's Efficient RANSAC and its region growing.

CGAL is given the true normals, and the best of nine settings is shown: the one that finds most of
the true pieces. Ours is given neither. Its rounded edges count as pieces. Region growing has planes
only. A method whose package is absent is left out.

    python examples/faces.py [OBJECT:TOUCHES ...]

OBJECT is plate, step, cube, wall or roof; touches are spread over the true surface.
"""

import sys
import time
from itertools import product

import numpy as np
from scipy.optimize import linear_sum_assignment

from touchatlas.atlas import Atlas, Faces
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim import Probe, make_object
from touchatlas.sim.study.surface_peers import Peer, spread
from touchatlas.sim.world.implicit_fields import polyhedron, union
from touchatlas.sim.world.implicit_object import ImplicitObject

INNER = np.array([45.0, 25.0, 5.0])
SLOPE = np.array([np.sin(np.deg2rad(25.0)), 0.0, np.cos(np.deg2rad(25.0))])
SIDES = np.concatenate([np.eye(3), -np.eye(3)])
# The field of a body of planes, and half its extent.
BODIES = {
    "wall": (polyhedron(SIDES, [20, 20, 3, 20, 20, 3]), (20, 20, 3)),
    "roof": (
        polyhedron(
            np.concatenate([[SLOPE, SLOPE * [-1, 1, 1]], SIDES[[0, 1, 3, 4, 5]]]),
            [10 * SLOPE[2], 10 * SLOPE[2], 25, 25, 25, 25, 20],
        ),
        (25, 25, 20),
    ),
    "step": (
        union(
            polyhedron(SIDES, [30, 20, 0, 30, 20, 20]), polyhedron(SIDES, [0, 20, 15, 30, 20, 20])
        ),
        (30, 20, 20),
    ),
}
# Largest distance from a shape in deviations of the noise, and fewest samples of a shape.
SETTINGS = tuple(product((1.0, 2.0, 3.0), (10, 20, 40)))
# Cosine of the largest angle between a normal and that of the shape, and the probability that a
# larger shape is missed: CGAL's own defaults. With a cosine of 0.97 as many pieces are found.
NORMAL_COSINE, MISSED = 0.9, 0.01


def body(name: str):
    """The object of a name."""
    return (
        ImplicitObject(name, "", *BODIES[name], 0.02, 0.1) if name in BODIES else make_object(name)
    )


def spread_atlas(obj, count: int) -> Atlas:
    """An atlas of touches spread over the object, as long as the planner would make them."""
    rng = np.random.default_rng(0)
    probe, atlas = Probe(obj, obj.noise_std, rng), Atlas(obj.tolerance)
    points, normals = obj.sample(20 * count, rng)
    for number, i in enumerate(spread(points, count)):
        bend = np.abs(obj.principal_curvatures(points[i : i + 1])[:2]).max()
        reach = np.clip(np.pi / 4 / max(bend, 1e-9), 60 * obj.tolerance, 200 * obj.tolerance)
        planes = concurrent_planes(points[i], normals[i], rng.normal(size=3), 3)
        plan = ProbePlan(
            number, points[i], normals[i], planes, reach, reach / 12, np.pi / 4, Reason.EXPAND
        )
        atlas.add(probe(plan))
    return atlas


def true_pieces(name: str, obj, points) -> np.ndarray:
    """(n,) number of the true piece of each point."""
    if name == "plate":
        block = np.where(np.abs(points) > INNER, np.sign(points), 0).astype(int)
        return (block + 1) @ [9, 3, 1]
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


def point_set(points, normals):
    """CGAL's set of points with normals. RANSAC reorders it, but its maps go by the numbers that
    points had when they were inserted."""
    from CGAL.CGAL_Kernel import Point_3, Vector_3
    from CGAL.CGAL_Point_set_3 import Point_set_3

    found = Point_set_3()
    found.add_normal_map()
    for point, normal in zip(points.tolist(), normals.tolist(), strict=True):
        found.insert(Point_3(*point), Vector_3(*normal))
    return found


def ransac(found, of, least: int, epsilon: float, gap: float) -> None:
    """Planes, cylinders and spheres by Efficient RANSAC (Schnabel, Wahl and Klein, 2007)."""
    from CGAL.CGAL_Shape_detection import efficient_RANSAC

    kinds = {"planes": True, "cylinders": True, "spheres": True}
    efficient_RANSAC(found, of, least, epsilon, gap, NORMAL_COSINE, MISSED, **kinds)


def growing(found, of, least: int, epsilon: float, gap: float) -> None:
    """Planes by region growing (Lafarge and Mallet, 2012)."""
    from CGAL.CGAL_Shape_detection import region_growing

    region_growing(found, of, least, epsilon, gap, NORMAL_COSINE)


PEERS = {
    "CGAL, Efficient RANSAC": Peer(ransac, SETTINGS, "CGAL"),
    "CGAL, region growing": Peer(growing, SETTINGS, "CGAL"),
}


def labelled(peer: Peer, setting, points, normals, noise: float, gap: float):
    """(n,) shape of each point, -1 of none; the seconds that took; the setting."""
    found = point_set(points, normals)
    of = found.add_int_map("shape")
    start = time.process_time()
    peer.call(found, of, setting[1], setting[0] * noise, gap)
    seconds = time.process_time() - start
    return np.array([of.get(i) for i in range(len(points))]), seconds, setting


def answers(obj, count: int):
    """Samples of touches spread over an object, and of each method its answers for all settings."""
    atlas = spread_atlas(obj, count)
    start = time.process_time()
    faces = atlas.faces()
    out = {"ours": [(edges_counted(faces), time.process_time() - start, "")]}
    normals = obj.normal(obj.project(faces.points))
    # Samples of one shape may be as far apart as touches are: one mean distance between these.
    given = faces.points, normals, obj.noise_std, np.sqrt(obj.area / count)
    for method, peer in PEERS.items():
        if peer.present():
            out[method] = [labelled(peer, setting, *given) for setting in peer.settings]
    return faces.points, out


def main(*words) -> None:
    print("| object, touches | method | shapes | found | right | seconds | setting |")
    print("|---|---|---|---|---|---|---|")
    for word in words or ("plate:400", "plate:150", "step:20", "cube:20"):
        name, _, count = word.partition(":")
        obj = body(name)
        points, out = answers(obj, int(count))
        truth = true_pieces(name, obj, points)
        for method, tried in out.items():
            results = [(*right_and_found(truth, one[0]), *one) for one in tried]
            right, found, of, seconds, setting = max(results, key=lambda row: (row[1], row[0]))
            shapes, pieces = len(np.unique(of[of >= 0])), len(np.unique(truth))
            print(f"| {name}, {count} | {method} | {shapes} | {found} of {pieces} | ", end="")
            print(f"{right:.4f} | {seconds:.2f} | {setting} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
