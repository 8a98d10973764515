"""Whole surfaces from the same touches: ours against others', with three kinds of normals.

Errors in 1e-4 of the diagonal, truth to surface where not said; of others the best of three
settings.

    python examples/surface_peers.py [OBJECT [TOUCHES [NOISE [CELLS [METHODS]]]]]

OBJECT is built in (blob:2 has seed 2), a mesh file, or a mesh in the folder TOUCHATLAS_OBJECTS;
TOUCHES how many places, spread evenly, or "explore" (a mesh: 400 at most); NOISE a fraction of the
diagonal; CELLS those of the others' grids along the longest side; METHODS names, or "all".
"""

import os
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

# Read when numpy is loaded.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

import igl
import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from touchatlas.atlas import Atlas, extract_surface
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, evaluate_surface, make_object, object_names, truth_of
from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.study.surface_peers import (
    PEERS,
    Peer,
    best_surface,
    samples_of,
    spread,
    spread_plans,
)
from touchatlas.sim.study.tradeoff import timed
from touchatlas.sim.world.implicit_object import ImplicitObject

FOLDER = os.environ.get("TOUCHATLAS_OBJECTS", Path(__file__).parents[2] / "shared" / "objects")
# Our surface is asked for with this fraction of the object's tolerance, so that neither triangles
# nor patches are coarser than the touches tell. At 1 triangles alone err by up to the noise.
FINER = 0.1
HEAD = "| method | normals | mean | rms | p99 | surface to truth | covered | setting | seconds |"
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)


def poisson_open3d(points, normals, setting, noise_std, cells):
    """Screened Poisson in Open3D; the setting is depth and point weight."""
    o3d = import_module("open3d")
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.normals = o3d.utility.Vector3dVector(normals)
    mesh, _ = o3d.geometry.TriangleMesh.create_from_point_cloud_poisson(
        cloud, depth=setting[0], point_weight=setting[1], samples_per_node=1.0, n_threads=1
    )
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles, dtype=np.int64)


def gpis(points, normals, setting, noise_std, cells):
    """Gaussian process of signed distances, Matern 5/2; the setting is length over diagonal.

    Williams and Fitzgibbon, Gaussian process implicit surfaces, 2006. The noise is known.
    """
    gaussian = import_module("sklearn.gaussian_process")
    # Scaled by the length, so that slopes of distances are one.
    length = setting * np.linalg.norm(np.ptp(points, axis=0))
    on = spread(points, 1400)
    off = on[:300]
    where, distance = _with_off_surface(points[on], points[off], normals[off])
    kernel, noise = gaussian.kernels.Matern(length, nu=2.5), (noise_std / length) ** 2 + 1e-10
    process = gaussian.GaussianProcessRegressor(kernel, alpha=noise, optimizer=None)
    process.fit(where, distance / length)

    def value(x):
        # Few points at a time, for the memory that kernels take.
        parts = np.array_split(x, 1 + len(x) // 2000)
        return length * np.concatenate([process.predict(part) for part in parts])

    return zero_set(value, points, cells)


def local_rbf(points, normals, setting, noise_std, cells):
    """Cubic radial functions of nearest points; the setting is how many, smoothing, most kept.

    Carr et al., Reconstruction and representation of 3D objects with radial basis functions,
    2001. Points are kept spread evenly: neighbours all on one curve tell nothing across it.
    """
    neighbours, smoothing, most = setting
    keep = spread(points, most)
    where, distance = _with_off_surface(points[keep], points[keep], normals[keep])
    count, unit = min(neighbours, len(where)), distance.max()
    # Smoothing is against cubes of distances, so it needs a unit.
    function = RBFInterpolator(where / unit, distance, count, smoothing=smoothing, kernel="cubic")
    return zero_set(lambda x: function(x / unit), points, cells)


def normals_of(obj, atlas: Atlas, touches):
    """Points (n, 3) of all contours, each once, and three kinds of normals (n, 3) with seconds."""
    points, ours = samples_of(atlas, touches)
    exact = exact_normals(obj, points)
    kinds = {"PCA": pca_normals(points, ours, exact), "ours": (ours, 0.0), "exact": (exact, 0.0)}
    return points, kinds


def pca_normals(points, outward, exact):
    """(n, 3) directions of least variance of the nearest points, turned to ``outward`` (n, 3):
    of three numbers of neighbours the one that comes nearest to the ``exact`` normals (n, 3)."""

    def normals(neighbours):
        near = cKDTree(points).query(points, min(neighbours, len(points)))[1]
        groups = points[near] - points[near].mean(axis=1, keepdims=True)
        found = np.linalg.eigh(groups.transpose(0, 2, 1) @ groups)[1][:, :, 0]
        return np.where((found * outward).sum(axis=1)[:, None] < 0.0, -found, found)

    agreement = [(normals(count) * exact).sum() for count in (12, 30, 80)]
    return timed(normals, (12, 30, 80)[int(np.argmax(agreement))])


def exact_normals(obj, points) -> np.ndarray:
    """(n, 3) outward unit normals of an object where it is nearest to points (n, 3)."""
    if isinstance(obj, ImplicitObject):
        return obj.normal(obj.project(points))
    tree = igl.AABB()
    tree.init(obj.vertices, obj.faces)
    faces = np.ravel(tree.squared_distance(obj.vertices, obj.faces, points)[1])
    return igl.per_face_normals(obj.vertices, obj.faces, np.zeros(3))[faces]


def zero_set(value: Callable, points, cells: int):
    """Triangles of a function's zeros, by marching cubes that start at points and follow it.

    ``value`` takes (n, 3) points to about their signed distances (n,); ``points`` (n, 3) lie on or
    near the surface, ``cells`` along the longest side of their box.
    """
    extent = np.ptp(points, axis=0)
    edge, margin = float(extent.max()) / cells, 0.1 * extent.max()
    start = points.min(axis=0) - margin
    shape = np.ceil((extent + 2.0 * margin) / edge).astype(int) + 2
    values, seen = np.full(shape, np.nan), np.zeros(shape, bool)
    cubes, fresh = [], np.unique(((points - start) / edge).astype(int), axis=0)
    while len(fresh):
        seen[tuple(fresh.T)] = True
        at = _corner_values(values, fresh, lambda index: value(start + edge * index))
        cut = (at.min(axis=1) < 0.0) & (at.max(axis=1) >= 0.0)
        cubes.append(fresh[cut])
        fresh = _unseen_neighbours(fresh[cut], at[cut] < 0.0, seen)
    corners = np.concatenate(cubes)[:, None] + CORNERS
    used, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    vertices, faces, _ = igl.marching_cubes(
        values[tuple(used.T)], start + edge * used, index.reshape(-1, 8)
    )
    # The cubes interpolate linearly; one step along the slope takes away most of what that errs.
    step = np.clip(value(vertices), -edge, edge)[:, None]
    return vertices - step * igl.per_vertex_normals(vertices, faces), faces.astype(np.int64)


def _corner_values(values, cubes, value_at) -> np.ndarray:
    """(m, 8) values at the corners of cubes; those not yet known are asked for and kept."""
    corners = cubes[:, None] + CORNERS
    where = tuple(np.moveaxis(corners, -1, 0))
    new = np.unique(corners[np.isnan(values[where])], axis=0)
    if len(new):
        values[tuple(new.T)] = value_at(new)
    return values[where]


def _unseen_neighbours(cubes, inside, seen) -> np.ndarray:
    """Cubes (k, 3) of the grid into which the surface goes on, not looked at before."""
    out = []
    for axis, side in np.ndindex(3, 2):
        face = inside[:, CORNERS[:, axis] == side]
        out.append(cubes[face.any(axis=1) & ~face.all(axis=1)])
        out[-1][:, axis] += 2 * side - 1
    found = np.unique(np.concatenate(out), axis=0)
    found = found[((found >= 0) & (found < np.array(seen.shape) - 1)).all(axis=1)]
    return found[~seen[tuple(found.T)]]


def _with_off_surface(surface, bases, normals):
    """Points on both sides of the surface added, and the signed distances of all."""
    offset = 0.01 * np.linalg.norm(np.ptp(surface, axis=0))
    where = np.concatenate([surface, bases + offset * normals, bases - offset * normals])
    return where, np.repeat([0.0, offset, -offset], [len(surface), len(bases), len(bases)])


METHODS = PEERS | {
    "Poisson (Open3D)": Peer(poisson_open3d, ((6, 4.0), (7, 4.0), (7, 40.0)), "open3d"),
    "GPIS": Peer(gpis, (0.3, 1.0, 3.0), "sklearn"),
    "local RBF": Peer(local_rbf, ((30, 0.0, 2000), (30, 10.0, 2000), (60, 100.0, 2000)), "scipy"),
}


def find(name: str):
    """The object of the first argument."""
    name, _, seed = name.partition(":")
    known = name in object_names() or Path(name).is_file()
    return make_object(name if known else f"{Path(FOLDER, name)}.ply", int(seed or 0))


def touch(obj, count: str, noise_std: float, rng) -> list:
    """Touches of an exploration, or at places spread evenly."""
    probe = Probe(obj, noise_std, rng)
    if count == "explore":
        most = None if obj.name in object_names() else 400
        steps = explore(Atlas(obj.tolerance), Planner(*obj.start()), probe, most)
        return [step.touch for step in steps]
    return [probe(plan) for plan in spread_plans(*obj.sample(4000, rng), int(count))]


def learn(touches, tolerance: float):
    """Our atlas of the touches, and its surface."""
    atlas = Atlas(FINER * tolerance)
    for one in touches:
        atlas.add(one)
    atlas.finish()
    return atlas, extract_surface(atlas)


def show(method, normals, surface, setting, seconds, truth, obj) -> None:
    e = evaluate_surface(*surface, truth, obj.tolerance, np.random.default_rng(0))
    p99 = np.quantile(ClosestPoints(*surface)(truth.points)[0], 0.99)
    lengths = (e.completeness_mean, e.completeness_rms, p99, e.accuracy_mean)
    figures = " | ".join(f"{1e4 * length / obj.diagonal:.3g}" for length in lengths)
    tail = f"{e.coverage:.3f} | {setting} | {seconds:.2f}"
    print(f"| {method} | {normals} | {figures} | {tail} |", flush=True)


def main(name="ellipsoid_paper", count="16", noise="2e-4", cells="32", methods="APSS") -> None:
    peers = METHODS if methods == "all" else {m: METHODS[m] for m in methods.split(",")}
    absent = [method for method in peers if not peers[method].present()]
    print(f"Left out, since what they import is absent: {', '.join(absent) or 'none'}.")
    obj, rng = find(name), np.random.default_rng(0)
    noise_std, truth = float(noise) * obj.diagonal, truth_of(obj, obj.tolerance, rng)
    touches = touch(obj, count, noise_std, rng)
    (atlas, ours), seconds = timed(lambda some: learn(some, obj.tolerance), touches)
    points, normals = normals_of(obj, atlas, touches)
    print(f"\n{name}, {count} touches, noise {noise}: {len(atlas)} patches, {len(points)} points")
    print(HEAD + "\n" + "|---" * (HEAD.count("|") - 1) + "|")
    show("touchatlas", "own", (ours.vertices, ours.faces), "", seconds, truth, obj)
    for kind, (directions, before) in normals.items():
        for method in peers.keys() - absent:
            data = (points, directions, noise_std, int(cells), truth.points[:4000])
            if found := best_surface(peers[method], *data):
                show(method, kind, found[0], found[1], before + found[2], truth, obj)


if __name__ == "__main__":
    main(*sys.argv[1:])
