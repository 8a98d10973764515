"""Whole surfaces by others: points and outward unit normals (n, 3) to vertices and faces.

Every method is called with a setting, the standard deviation of the noise and how many cells its
grid, where it has one, has along the longest side of the points.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas import Atlas
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.plans import concurrent_planes
from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.study.tradeoff import timed


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


PEERS = {
    "APSS": Peer(mls("apss"), (2.5, 4.0, 6.0), "pymeshlab"),
    "RIMLS": Peer(mls("rimls"), (1.5, 2.0, 4.0), "pymeshlab"),
    "Poisson": Peer(poisson, ((6, 4.0), (7, 4.0), (7, 40.0)), "pymeshlab"),
}


def best_surface(peer: Peer, points, normals, noise_std: float, cells: int, truth):
    """Vertices and faces of a peer's best setting, that setting, and its processor seconds.

    Settings are compared by the mean distance of exact points ``truth`` (m, 3) to the surface, on
    a grid half as fine. None when no setting gives a surface.
    """
    losses = []
    for setting in peer.settings:
        found = _try(peer, points, normals, setting, noise_std, max(cells // 2, 8))
        losses.append(np.inf if found is None else ClosestPoints(*found)(truth)[0].mean())
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


def samples_of(atlas: Atlas, touches) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of all contours, each once, and the normals (n, 3) of an atlas there, or of the
    touches where it knows none."""
    pairs = [(p, t.approach) for t in touches for c in t.contours for p in c.points_in_plane]
    once = np.unique(np.array([p for p, _ in pairs]).round(9), axis=0, return_index=True)[1]
    points, outward = np.array(pairs)[once].transpose(1, 0, 2).copy()
    seen = atlas.blend(points)
    return points, np.where(seen.known[:, None], seen.normal, outward)


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
    reach = 1.7 * float(cKDTree(points[at]).query(points)[0].max())
    arms = reach, reach / 12, np.deg2rad(75.0)
    return [
        ProbePlan(number, p, n, concurrent_planes(p, n, any_tangent(n), 3), *arms, Reason.START)
        for number, (p, n) in enumerate(zip(points[at], normals[at], strict=True))
    ]


def _meshlab(points, normals, run: str, **parameters):
    """Vertices and faces that one of MeshLab's filters makes of a cloud."""
    meshlab = import_module("pymeshlab")
    scene = meshlab.MeshSet(verbose=False)
    scene.add_mesh(meshlab.Mesh(vertex_matrix=points, v_normals_matrix=normals))
    getattr(scene, run)(**parameters)
    mesh = scene.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64)
