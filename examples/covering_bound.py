"""How many patches an exploration leaves, over how few any quartics could be.

A disc of radius r in which a degree holds the surface to the tolerance covers at most pi r^2,
and discs in the plane overlap: 1.209 A / (pi r^2) are needed at least (Kershner, The number of
circles covering a set, 1939). Here r varies over the true surface: 1.209 / pi times the integral
of dA / r^2, over area-uniform points.

r is where the height over the tangent plane, along the worst of six lines, cannot be held to
the tolerance by any quartic, or the surface has turned by 45 degrees. Discs are taken for flat.

    python examples/covering_bound.py [OBJECT ...]
"""

import sys

import numpy as np

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, make_object

KERSHNER, LEAST_COSINE = 1.209, np.sqrt(0.5)
POINTS, LINES, NEWTON_STEPS = 300, 6, 6
RADII = np.geomspace(0.01, 0.5, 100)  # of the diagonal; the first that is too large counts


def heights(obj, points, normals, offsets):
    """Heights (..., k) of the surface over offsets (..., k, 3) from points in tangent planes, and
    cosines (..., k) of the surface's normal there with theirs; NaN where it is not met."""
    height = np.zeros(offsets.shape[:-1])
    for _ in range(NEWTON_STEPS):
        places = points + offsets + height[..., None] * normals
        value, gradient = obj.field.first_order(places.reshape(-1, 3))
        gradient = gradient.reshape(places.shape)
        slope = (gradient * normals).sum(axis=-1)
        step = value.reshape(slope.shape) / np.where(slope > 0, slope, np.nan)
        height = height - step
    size = np.sqrt((offsets * offsets).sum(axis=-1))
    met = np.abs(step) <= 1e-6 * size.max()
    length = np.sqrt((gradient * gradient).sum(axis=-1))
    return np.where(met, height, np.nan), np.where(met, slope / length, np.nan)


def least_error(height, degree):
    """No polynomial of the degree comes nearer than this to heights (..., degree + 2) at the
    extrema of the Chebyshev polynomial of degree + 1 (de la Vallee-Poussin)."""
    signs = (-1.0) ** np.arange(degree + 2)
    signs[[0, -1]] *= 0.5
    return np.abs(height @ signs) / (degree + 1)


def radii(obj, points, normals):
    """(n,) how far quartics hold the surface about points (n, 3)."""
    out, holds = np.full(len(points), RADII[0]), np.ones(len(points), bool)
    e1, e2 = np.linalg.svd(normals[:, None])[2][:, 1:].transpose(1, 0, 2)
    angles = np.pi / LINES * np.arange(LINES)[:, None]
    lines = np.cos(angles)[:, :, None] * e1 + np.sin(angles)[:, :, None] * e2
    for fraction in RADII:
        for degree in (4, 5):  # Odd and even parts: no quintic, so no quartic either.
            places = fraction * obj.diagonal * np.cos(np.pi * np.arange(degree + 2) / (degree + 1))
            offsets = places[:, None] * lines[..., None, :]
            over = points[:, None], normals[:, None]
            height, cosine = heights(obj, *over, offsets)
            good = (least_error(height, degree) <= obj.tolerance).all(axis=0)
            holds &= good & (cosine >= LEAST_COSINE).all(axis=(0, 2))
        out[holds] = fraction
    return out * obj.diagonal * RADII[1] / RADII[0]


def main(*names) -> None:
    print("| object | bound | patches | over |\n|---|---|---|---|")
    for name in names or ("sphere",):
        obj, rng = make_object(name), np.random.default_rng(0)
        points, normals = obj.sample(POINTS, rng)
        bound = KERSHNER / np.pi * obj.area * np.mean(radii(obj, points, normals) ** -2.0)
        atlas, probe = Atlas(obj.tolerance), Probe(obj, obj.noise_std, rng)
        for _ in explore(atlas, Planner(*obj.start()), probe):
            pass
        print(f"| {name} | {bound:.1f} | {len(atlas)} | {len(atlas) / bound:.2f} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
