"""Three solvers of the paper's (5), from the same start, on curves of known surfaces.

The paper's steepest descent, scipy's L-BFGS-B with the exact gradient, and the library's
primal-dual Newton: the objective that each reaches over the least of the three, and how many
times as long the first two take.

    python examples/fold_solvers.py [SEEDS [NOISE ...]]
"""

import os
import sys
import time
from itertools import product

# Products this small are slower, and their times wild, on more threads than one.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np
from scipy.optimize import minimize

from touchatlas.patch.paper.newton import newton_minimum
from touchatlas.patch.paper.steepest_descent import sign_frozen_descent
from touchatlas.patch.paper.total_curvature import fold_problem, objective_and_gradient

# Height over the tangent plane, k1, k2 and half the length of a curve; millimetres.
SURFACES = {
    "ball 33": (lambda x, y: np.sqrt(33**2 - x**2 - y**2) - 33, -1 / 33, -1 / 33, 20),
    "ellipsoid 80/50/30": (
        lambda x, y: 30 * np.sqrt(1 - (x / 80) ** 2 - (y / 50) ** 2) - 30,
        *(-30 / 80**2, -30 / 50**2, 20),
    ),
    "torus 40/15, outside": (
        lambda x, y: np.sqrt((40 + np.sqrt(15**2 - y**2)) ** 2 - x**2) - 55,
        *(-1 / 55, -1 / 15, 11),
    ),
    "torus 40/15, inside": (
        lambda x, y: 25 - np.sqrt((40 - np.sqrt(15**2 - y**2)) ** 2 - x**2),
        *(1 / 25, -1 / 15, 11),
    ),
    "neck": (
        lambda x, y: 0.009 * x**2 - 0.021 * y**2 + 2e-4 * x**3 - 1e-5 * y**4 - 6e-6 * x**2 * y**2,
        *(0.018, -0.042, 15),
    ),
    "monkey saddle": (lambda x, y: (x**3 - 3 * x * y**2) / 600, 0.0, 0.0, 12),
}


def curves(height, half_length, noise, rng):
    """(57, 3) points of three concurrent curves 60 degrees apart."""
    t, turn = np.linspace(-half_length, half_length, 19), rng.uniform(0, np.pi)
    angles = turn + np.pi / 3 * np.arange(3)
    x, y = (np.outer(f(angles), t).ravel() for f in (np.cos, np.sin))
    points = np.stack([x, y, height(x, y)], axis=1)
    return points + noise * rng.normal(size=points.shape)


def timed(solve, repeats):
    """Objective that a solver reaches, and its best time in seconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        value = solve()
        times.append(time.perf_counter() - start)
    return value, min(times)


def main(seeds="1", *noises) -> None:
    print(f"{'case':32} {'descent':>9} {'L-BFGS':>9} {'Newton':>9}   ms   x descent  x L-BFGS")
    worst, ratios = -np.inf, []
    for name, (height, k1, k2, half_length) in SURFACES.items():
        for noise, lam, seed in product(noises or ["0.02"], (0.03, 0.3, 3.0), range(int(seeds))):
            points = curves(height, half_length, float(noise), np.random.default_rng(seed))
            p = fold_problem(points, k1, k2, lam)
            value = [lambda a, p=p: objective_and_gradient(p, a)[:2], np.zeros(p.size)]
            solvers = (
                lambda p=p: sign_frozen_descent(p).objective,
                lambda v=value: minimize(*v, jac=True, method="L-BFGS-B").fun,
                lambda p=p: newton_minimum(p).objective,
            )
            found = [timed(s, n) for s, n in zip(solvers, (1, 2, 3), strict=True)]
            values, times = np.array(found).T
            excess, ratio = values / values.min() - 1, times[:2] / times[2]
            worst = max(worst, values[2] / values[:2].min() - 1)
            ratios.append(ratio)
            row = " ".join(f"{e:9.1e}" for e in excess)
            print(f"{name:21} {noise:>4} {lam:5} {row} {1e3 * times[2]:5.2f}", end="")
            print(f" {ratio[0]:9.1f} {ratio[1]:9.1f}")
    print("median ratios", np.median(ratios, axis=0).round(1))
    print(f"worst excess of Newton over the best of the others: {worst:.1e}")


if __name__ == "__main__":
    main(*sys.argv[1:])
