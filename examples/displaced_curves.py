"""How often deviations hold the curvatures where one of three curves is displaced.

    python examples/displaced_curves.py [COUNT]

Three curves of 61 points and a noise of 0.02 run through one point of five surfaces. One curve is
displaced: up, or to any side. Prints, of those that are flagged, how many of COUNT (20), the
fraction of k1 and k2 within two and three deviations, and the medians of deviation and error.
"""

import sys

import numpy as np

from touchatlas.sim.recorded.curves import Curve
from touchatlas.sim.recorded.fit_file import _fit
from touchatlas.sim.recorded.recording import prepare

NOISE, HALF, POINTS = 0.02, 12.0, 61
UP = np.array([0.0, 0.0, 1.0])
# Curvatures a, b and g of z = (a x^2 + b y^2 + g z^2) / 2, and the height of a wave along x.
SURFACES = {
    "ball": (-1 / 33, -1 / 33, -1 / 33, 0.0),
    "saddle": (0.02, -0.03, 0.0, 0.0),
    "ellipsoid": (-1 / 50, -1 / 20, -1 / 30, 0.0),
    "cylinder": (0.0, -1 / 25, -1 / 25, 0.0),
    "waves": (-0.03, -0.04, 0.0, 0.3),
}


def section(surface, angle, rng):
    """(n, 3) noisy points of the section of a surface with the plane of an angle and z."""
    a, b, g, wave = surface
    points = np.linspace(-HALF, HALF, POINTS)[:, None] * [np.cos(angle), np.sin(angle), 0.0]
    x, y = points[:, 0], points[:, 1]
    for _ in range(60):
        points[:, 2] = 0.5 * (a * x * x + b * y * y + g * points[:, 2] ** 2)
        points[:, 2] += wave * (np.sin(x / 6.0) - x / 6.0)
    return points + rng.normal(0.0, NOISE, points.shape)


def displaced_fit(surface, size, up, seed):
    """Whether it is flagged, and k1, k2 with deviations, of one draw."""
    rng = np.random.default_rng([7, seed])
    first = rng.uniform(0.0, np.pi)
    curves = [section(surface, first + k * np.pi / 3.0, rng) for k in range(3)]
    side = UP if up else rng.normal(size=3)
    curves[seed % 3] += size * side / np.linalg.norm(side)
    recording = prepare([Curve(name, c, None) for name, c in zip("abc", curves, strict=True)])
    curvatures = _fit("map", recording, UP)[0].curvatures
    flagged = "curves do not meet" in recording.flags
    return flagged, np.array([curvatures.k1, curvatures.k2]), curvatures.std


def main(count: int) -> None:
    """Print a row for each surface, side and size."""
    print("| surface | side | offset | flagged | within 2 | within 3 | deviation | error |")
    print("|---|---|---|---|---|---|---|---|")
    for name, surface in SURFACES.items():
        truth = np.sort(surface[:2])[::-1]
        for up in (True, False):
            for size in (0.05, 0.2, 1.0, 3.0, 8.0):
                fits = [displaced_fit(surface, size, up, seed) for seed in range(count)]
                fits = [fit for fit in fits if fit[0]]
                if not fits:
                    continue
                error = np.abs(np.array([k for _, k, _ in fits]) - truth)
                std = np.array([s for _, _, s in fits])
                z = error / std
                print(
                    f"| {name} | {'up' if up else 'any'} | {size} | {len(fits)} "
                    f"| {np.mean(z < 2.0):.2f} | {np.mean(z < 3.0):.2f} | {np.median(std):.5f} "
                    f"| {np.median(error):.5f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
