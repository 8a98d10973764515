"""Whole surfaces by others: points and outward unit normals (n, 3) to vertices and faces.

Every method is called with a setting, the standard deviation of the noise and how many cells its
grid, where it has one, has along the longest side of the points.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

import igl
import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

from touchatlas.atlas import Atlas
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim.study.tradeoff import timed
from touchatlas.sim.world.implicit_object import ImplicitObject

_CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)
# Margin of the grid around the box of the points, as a fraction of the longest side. Twice as much
# makes cells coarser by a sixth.
_MARGIN = 0.1
# Distance of points off the surface from it, as a fraction of the diagonal. Twice as much takes
# points of thin parts across to the other side.
_OFFSET = 0.01
# At most 2,000 in all: on the surface, and on each side of it.
_GPIS_ON, _GPIS_OFF = 1400, 300
_PCA_NEIGHBOURS = (12, 30, 80)
# An arm has so many points, reaches so far over the spacing of the places, and turns so much.
_ARM_POINTS, _REACH, _TURN = 12, 1.7, np.deg2rad(75.0)


@dataclass(frozen=True)
class Peer:
    """A method, three settings to choose from, and what it imports."""

    call: Callable
    settings: tuple
    package: str

    def present(self) -> bool:
        """Whether the package can be imported."""
        try:
            import_module(self.package)
        except ImportError:
            return False
        return True


def mls(name: str) -> Callable:
    """MeshLab's ``apss`` or ``rimls``; the setting is the filter's width in local spacings.

    Guennebaud and Gross, Algebraic point set surfaces, 2007; Oztireli, Guennebaud and Gross,
    Feature preserving point set surfaces based on non-linear kernel regression, 2009.
    """

    def call(points, normals, setting, noise_std, cells):
        run = f"generate_marching_cubes_{name}"
        return _meshlab(points, normals, run, filterscale=setting, resolution=cells)

    return call


def poisson(points, normals, setting, noise_std, cells):
    """Screened Poisson in MeshLab; the setting is depth and point weight.

    Kazhdan and Hoppe, Screened Poisson surface reconstruction, 2013.
    """
    run = "generate_surface_reconstruction_screened_poisson"
    weights = {"pointweight": setting[1], "samplespernode": 1.0}
    return _meshlab(points, normals, run, depth=setting[0], threads=1, **weights)


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
    on = spread(points, _GPIS_ON)
    off = on[:_GPIS_OFF]
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


PEERS = {
    "APSS": Peer(mls("apss"), (2.5, 4.0, 6.0), "pymeshlab"),
    "RIMLS": Peer(mls("rimls"), (1.5, 2.0, 4.0), "pymeshlab"),
    "Poisson": Peer(poisson, ((6, 4.0), (7, 4.0), (7, 40.0)), "pymeshlab"),
    "Poisson (Open3D)": Peer(poisson_open3d, ((6, 4.0), (7, 4.0), (7, 40.0)), "open3d"),
    "GPIS": Peer(gpis, (0.3, 1.0, 3.0), "sklearn"),
    "local RBF": Peer(local_rbf, ((30, 0.0, 2000), (30, 10.0, 2000), (60, 100.0, 2000)), "scipy"),
}


def best_surface(peer: Peer, points, normals, noise_std: float, cells: int, truth):
    """Vertices and faces of a peer's best setting, that setting, and its processor seconds.

    Settings are compared by the mean distance of exact points ``truth`` (m, 3) to the surface, on
    a grid half as fine. None when no setting gives a surface.
    """
    losses = []
    for setting in peer.settings:
        found = _try(peer, points, normals, setting, noise_std, max(cells // 2, 8))
        losses.append(np.inf if found is None else distances(*found, truth).mean())
    best = peer.settings[int(np.argmin(losses))]
    found, seconds = timed(lambda s: _try(peer, points, normals, s, noise_std, cells), best)
    return None if found is None else (found, best, seconds)


def _try(peer: Peer, *arguments) -> tuple[np.ndarray, np.ndarray] | None:
    """Vertices and faces, or None where the method gives no surface."""
    try:
        vertices, faces = peer.call(*arguments)
    # Each package has exceptions of its own for points it cannot handle.
    except Exception:
        return None
    return (vertices, faces) if len(faces) and np.isfinite(vertices).all() else None


def distances(vertices, faces, points) -> np.ndarray:
    """(n,) distances of points (n, 3) from a triangle mesh, length."""
    tree = igl.AABB()
    tree.init(vertices, faces)
    return np.sqrt(np.ravel(tree.squared_distance(vertices, faces, points)[0]))


def points_and_normals(obj, atlas: Atlas, touches):
    """Points (n, 3) of all contours, each once, and three kinds of normals (n, 3) with seconds."""
    pairs = [(p, t.approach) for t in touches for c in t.contours for p in c.points_in_plane]
    once = np.unique(np.array([p for p, _ in pairs]).round(9), axis=0, return_index=True)[1]
    points, outward = np.array(pairs)[once].transpose(1, 0, 2).copy()
    exact, seen = exact_normals(obj, points), atlas.blend(points)
    components, seconds = pca_normals(points, outward, exact)
    ours = np.where(seen.known[:, None], seen.normal, components)
    return points, {"PCA": (components, seconds), "ours": (ours, 0.0), "exact": (exact, 0.0)}


def pca_normals(points, outward, exact):
    """(n, 3) directions of least variance of the nearest points, turned to ``outward`` (n, 3):
    of three numbers of neighbours the one that comes nearest to the ``exact`` normals (n, 3)."""

    def normals(neighbours):
        near = cKDTree(points).query(points, min(neighbours, len(points)))[1]
        groups = points[near] - points[near].mean(axis=1, keepdims=True)
        found = np.linalg.eigh(groups.transpose(0, 2, 1) @ groups)[1][:, :, 0]
        return np.where((found * outward).sum(axis=1)[:, None] < 0.0, -found, found)

    agreement = [(normals(count) * exact).sum() for count in _PCA_NEIGHBOURS]
    return timed(normals, _PCA_NEIGHBOURS[int(np.argmax(agreement))])


def exact_normals(obj, points) -> np.ndarray:
    """(n, 3) outward unit normals of an object where it is nearest to points (n, 3)."""
    if isinstance(obj, ImplicitObject):
        return obj.normal(obj.project(points))
    tree = igl.AABB()
    tree.init(obj.vertices, obj.faces)
    faces = np.ravel(tree.squared_distance(obj.vertices, obj.faces, points)[1])
    return igl.per_face_normals(obj.vertices, obj.faces, np.zeros(3))[faces]


def spread(points, count: int) -> np.ndarray:
    """Indices of at most ``count`` points, each the farthest from those before."""
    chosen = [0]
    square = ((points - points[0]) ** 2).sum(axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(square.argmax()))
        square = np.minimum(square, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
    return np.array(chosen)


def spread_plans(points, normals, count: int) -> list[ProbePlan]:
    """Plans at ``count`` of some exact points, spread evenly, in planes through the normal."""
    at = spread(points, count)
    reach = _REACH * float(cKDTree(points[at]).query(points)[0].max())
    step = reach / _ARM_POINTS
    return [
        ProbePlan(
            number,
            p,
            n,
            concurrent_planes(p, n, any_tangent(n), 3),
            reach,
            step,
            _TURN,
            Reason.START,
        )
        for number, (p, n) in enumerate(zip(points[at], normals[at], strict=True))
    ]


def zero_set(value: Callable, points, cells: int):
    """Triangles of a function's zeros, by marching cubes that start at points and follow it.

    ``value`` takes (n, 3) points to about their signed distances (n,); ``points`` (n, 3) lie on or
    near the surface, ``cells`` along the longest side of their box.
    """
    extent = np.ptp(points, axis=0)
    edge, margin = float(extent.max()) / cells, _MARGIN * extent.max()
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
    corners = np.concatenate(cubes)[:, None] + _CORNERS
    used, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    vertices, faces, _ = igl.marching_cubes(
        values[tuple(used.T)], start + edge * used, index.reshape(-1, 8)
    )
    # The cubes interpolate linearly; one step along the slope takes away most of what that errs.
    step = np.clip(value(vertices), -edge, edge)[:, None]
    return vertices - step * igl.per_vertex_normals(vertices, faces), faces.astype(np.int64)


def _corner_values(values, cubes, value_at) -> np.ndarray:
    """(m, 8) values at the corners of cubes; those not yet known are asked for and kept."""
    corners = cubes[:, None] + _CORNERS
    where = tuple(np.moveaxis(corners, -1, 0))
    new = np.unique(corners[np.isnan(values[where])], axis=0)
    if len(new):
        values[tuple(new.T)] = value_at(new)
    return values[where]


def _unseen_neighbours(cubes, inside, seen) -> np.ndarray:
    """Cubes (k, 3) of the grid into which the surface goes on, not looked at before."""
    out = []
    for axis, side in np.ndindex(3, 2):
        face = inside[:, _CORNERS[:, axis] == side]
        out.append(cubes[face.any(axis=1) & ~face.all(axis=1)])
        out[-1][:, axis] += 2 * side - 1
    found = np.unique(np.concatenate(out), axis=0)
    found = found[((found >= 0) & (found < np.array(seen.shape) - 1)).all(axis=1)]
    return found[~seen[tuple(found.T)]]


def _with_off_surface(surface, bases, normals):
    """Points on both sides of the surface added, and the signed distances of all."""
    offset = _OFFSET * np.linalg.norm(np.ptp(surface, axis=0))
    where = np.concatenate([surface, bases + offset * normals, bases - offset * normals])
    return where, np.repeat([0.0, offset, -offset], [len(surface), len(bases), len(bases)])


def _meshlab(points, normals, run: str, **parameters):
    """Vertices and faces that one of MeshLab's filters makes of a cloud."""
    meshlab = import_module("pymeshlab")
    scene = meshlab.MeshSet(verbose=False)
    scene.add_mesh(meshlab.Mesh(vertex_matrix=points, v_normals_matrix=normals))
    getattr(scene, run)(**parameters)
    mesh = scene.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64)
