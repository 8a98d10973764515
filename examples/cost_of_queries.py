"""What a question costs as a free-form surface has more patches, and how large a patch is.

Samples of a ball with ripples are fitted from scratch. The shorter the ripples, the smaller are the
patches and the more there are. Then the distance, normal and deviation at 1,000 random points
near the surface are asked for, all at once; the best of five times.

    python examples/cost_of_queries.py [RIPPLES ...]

RIPPLES is their number around the ball; more of them need more samples.
"""

import os
import pickle
import sys
import time

# Read when numpy is loaded.
os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1"))

import numpy as np

from touchatlas.atlas.surfaces.fit_free_form import fit_free_form
from touchatlas.sim.command.outcome import exit_code

# Samples for each square of the number of ripples: about a hundred in a patch.
SAMPLES = 100
# Height of a ripple and deviation of a sample, over the radius of the ball and the square of the
# number of ripples: their bend is the same for all.
HEIGHT, NOISE = 0.3, 3e-4


def rippled_ball(ripples: int, count: int, rng) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) points of a ball of radius 1 with ripples, and its outward normals."""
    z = rng.uniform(-1.0, 1.0, count)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    flat = np.sqrt(1.0 - z * z)
    out = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), z])
    waves = np.sin(ripples * out)
    slope = ripples * np.cos(ripples * out)
    height = HEIGHT / ripples**2
    radius = 1.0 + height * waves.sum(axis=1)
    tangent = slope - (slope * out).sum(axis=1)[:, None] * out
    normals = out - height * tangent / radius[:, None]
    return radius[:, None] * out, normals / np.linalg.norm(normals, axis=1)[:, None]


def main(*numbers: str) -> None:
    print("| ripples | samples | patches | kB a patch | fit, s | ms for 1,000 questions | ratio |")
    print("|---|---|---|---|---|---|---|")
    first = None
    for number in numbers or ("8", "24", "80"):
        if not number.isdecimal() or int(number) < 1:
            raise ValueError(f"RIPPLES is {number!r}; it must be a whole number above 0, such as 8")
        ripples = int(number)
        rng = np.random.default_rng(0)
        points, normals = rippled_ball(ripples, SAMPLES * ripples**2, rng)
        noise = NOISE / ripples**2
        points = points + noise * rng.normal(size=len(points))[:, None] * normals
        start = time.process_time()
        surface = fit_free_form(points, normals, noise, 0.5)
        fitted = time.process_time() - start
        size = len(pickle.dumps(surface.sextics)) / len(surface.sextics)
        asked = points[rng.choice(len(points), 1000)] + noise * rng.normal(size=(1000, 3))
        best = min(seconds(surface, asked) for _ in range(5))
        first = first or best
        print(
            f"| {ripples} | {len(points)} | {len(surface.sextics)} | {size / 1e3:.1f} | "
            f"{fitted:.2f} | {1e3 * best:.1f} | {best / first:.2f} |",
            flush=True,
        )


def seconds(surface, points) -> float:
    start = time.process_time()
    surface.values(points)
    return time.process_time() - start


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(*sys.argv[1:])))
