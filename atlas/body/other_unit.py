"""Points in another unit than the known surface: multiplied by a ratio of units they lie on it."""

import numpy as np

from touchatlas.atlas.body.body import Body
from touchatlas.patch.geometry.arrays import evenly

# Ratios of units of length that people mix: um, mm, cm, m, inch, and mm to foot. Others lie so near
# to one of these that lengths of curves can't tell them.
UNIT_RATIOS = (2.54, 10.0, 25.4, 100.0, 304.8, 1000.0, 1e6)


def unit_factor(body: Body, points, stds, outward, sure: float) -> float | None:
    """The ratio of units by which points would lie on a surface, none of which does as it is; None
    where some do, where no ratio puts half of them there, or where their spacing is rather that of
    the samples as it is: a probe keeps its step, and a small feature may lie as a large one does.

    A plane or cone with its tip at the origin is mapped onto itself by any factor. So points count
    whose tangent plane passes the origin by more than ten times what counts as on the surface.

    Parameters
    ----------
    body : Body
    points : (n, 3) float, length, world
    stds : (n,) float, length
        Of their distances from the surface.
    outward : (n, 3) or (3,) float
        To the free side of each; zero where it is not known. A surface that faces away from it, as
        the rim of a ring from the bore, is another one.
    sure : float
        Deviations within which a point is on the surface.
    """

    def on_surface(factor: float, apart: float, some=slice(None)) -> float:
        moved = factor * points[some]
        found, known = body.at(moved)
        limit = sure * np.hypot(found.deviation, factor * stds[some])
        tells = np.abs((found.normal * moved).sum(axis=1)) > apart * limit
        if factor != 1.0:
            tells &= (found.normal * outward).sum(axis=1) >= 0.0
        return float(np.mean(known & tells & (np.abs(found.distance) <= limit)))

    # Most touches have some points on it, which a few of them show.
    few = evenly(np.arange(len(points)), 64)
    if on_surface(1.0, -1.0, few) > 0.0 or on_surface(1.0, -1.0) > 0.0:
        return None
    ratios = np.array(UNIT_RATIOS)
    factors = np.concatenate([ratios, 1.0 / ratios]).tolist()
    share, factor = max((on_surface(factor, 10.0), factor) for factor in factors)
    step = np.median(np.linalg.norm(np.diff(points, axis=0), axis=1))
    ratio = np.log(np.median(body.samples.steps) / max(step, np.finfo(float).tiny))
    return factor if share > 0.5 and abs(ratio - np.log(factor)) < abs(ratio) else None
