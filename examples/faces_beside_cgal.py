"""Faces from the same samples: ours beside CGAL's Efficient RANSAC and its region growing.

CGAL is given the true normals, and the best of nine settings is shown: the one that finds most of
the true pieces. Ours is given neither. Its rounded edges count as pieces. Region growing has planes
only.

    python examples/faces_beside_cgal.py [OBJECT:TOUCHES ...]

OBJECT is one whose pieces `faces.py` knows: plate, step, cube, wall or roof.
"""

import sys
import time
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
from faces import body, edges_counted, right_and_found, spread_atlas, true_pieces

from touchatlas.sim.study.surface_peers import Peer

# Largest distance from a shape in deviations of the noise, and fewest samples of a shape.
SETTINGS = tuple(product((1.0, 2.0, 3.0), (10, 20, 40)))
# Cosine of the largest angle between a normal and that of the shape, and the probability that a
# larger shape is missed: CGAL's own defaults. With a cosine of 0.97 as many pieces are found.
NORMAL_COSINE, MISSED = 0.9, 0.01


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
    atlas = spread_atlas(obj, count, 0)
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
