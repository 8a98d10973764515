"""The law that whole surfaces of a study meet or miss."""

from dataclasses import dataclass

import numpy as np
import trimesh

from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.world.triangles import sample_triangles


@dataclass(frozen=True)
class EconomyOptions:
    """How far runs go, and how their surfaces are judged.

    Parameters
    ----------
    objects : tuple of str
        Those that are explored where none is named.
    tolerances : tuple of float
        Fractions of the diagonal,
    least_noises : float
        of which those below so many standard deviations of the noise are left out.
    most : int
        Touches after which a run ends.
    points : int
        At which either surface is compared with the other: the standard error of a share of 0.99
        is 0.001.
    share, off : float
        A surface that meets the tolerance has this share of the truth within it, and the same
        share of its own points within so many tolerances.
    sagitta : float
        By which the truth's triangles may be off, in tolerances.
    cells : int
        Of others' grids along the longest side.
    """

    objects: tuple[str, ...] = ("ellipsoid", "blob")
    tolerances: tuple[float, ...] = (1e-3, 3e-3, 1e-2, 3e-4)
    least_noises: float = 2.0
    most: int = 120
    points: int = 8000
    share: float = 0.99
    off: float = 2.0
    sagitta: float = 0.02
    cells: int = 48


OPTIONS = EconomyOptions()


def judged(
    mesh: tuple[np.ndarray, np.ndarray] | None,
    obj,
    truth,
    tolerance: float,
    options: EconomyOptions = OPTIONS,
) -> dict[str, float]:
    """``mean_error``, ``p95_error`` (truth to surface, length), ``known_share`` and ``met``.

    Met: 99 % of the truth within the tolerance, 99 % of the surface within twice of it,
    watertight, right Euler characteristic.

    Parameters
    ----------
    mesh : vertices (v, 3) and faces (f, 3), or None
    obj : the object
    truth : (n, 3) float, length
        Points of its surface.
    tolerance : float, length
    options : EconomyOptions
    """
    if mesh is None or not len(mesh[1]):
        return {"mean_error": np.nan, "p95_error": np.nan, "known_share": 0.0, "met": 0.0}
    missed = ClosestPoints(*mesh)(truth)[0]
    share = float(np.mean(missed <= tolerance))
    points = sample_triangles(*mesh, options.points, np.random.default_rng(0))[0]
    vertices, faces = obj.mesh(options.sagitta * tolerance)
    off = np.quantile(ClosestPoints(vertices, faces)(points)[0], options.share)
    body = trimesh.Trimesh(*mesh, process=False)
    right = not obj.closed or body.is_watertight
    right = right and body.euler_number == obj.euler_characteristic
    return {
        "mean_error": float(missed.mean()),
        "p95_error": float(np.quantile(missed, 0.95)),
        "known_share": share,
        "met": float(right and share >= options.share and off <= options.off * tolerance),
    }
