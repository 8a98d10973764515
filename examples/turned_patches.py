"""Patches that turn away from their tangent plane: terms in z against a height alone.

Arms run on until the first of them has turned by 30, 60 or 80 degrees. Both estimators get the
same three curves; errors are mean distances of exact points on nine other curves, over the
diagonal of the object's box, medians over the draws.

    python examples/turned_patches.py [DRAWS]
"""

import sys

import numpy as np

from touchatlas.patch import FitOptions, Patch, fit_patch
from touchatlas.sim.study.scenes import Scene, draw_scene

SURFACES = ("ball", "torus", "ellipsoid")
TURNS = (30, 60, 80)
NOISES = (0.0, 2e-4)
LONGEST_ARM = 80.0
DEFAULT, HEIGHT = FitOptions(), FitOptions(height_only=True, adaptive=False)


def distance(patch: Patch, points) -> np.ndarray:
    """(n,) distance of points to a patch: three steps along the normals of where they arrive.

    One first-order distance would be too short where the patch curves.
    """
    foot = points
    for _ in range(3):
        foot = foot - patch.signed_distance(foot)[:, None] * patch.normal(foot)
    return np.linalg.norm(foot - points, axis=1)


def scene_of(surface: str, turn: int, noise: float, draw: int) -> Scene:
    """Scene of a surface with arms that turn by ``turn`` degrees, noise over the diagonal."""
    length = noise * diagonal_of(surface)
    rng = np.random.default_rng([draw, turn])
    return draw_scene(surface, length, 0.0, rng, turn=np.deg2rad(turn), reach=LONGEST_ARM)


def diagonal_of(surface: str) -> float:
    """Diagonal of the box of the object that a surface is of."""
    return draw_scene(surface, 0.0, 0.0, np.random.default_rng(0)).surface.diagonal


def errors(surface: str, turn: int, noise: float, draws: int) -> np.ndarray:
    """(draws, 2) mean distances over the diagonal: of the default, of the Monge quartic."""
    rows = []
    for draw in range(draws):
        scene = scene_of(surface, turn, noise, draw)
        rows.append(
            [
                distance(
                    fit_patch(scene.contact, scene.contours, scene.normal, options=options).patch,
                    scene.verifying,
                ).mean()
                for options in (DEFAULT, HEIGHT)
            ]
        )
    return np.array(rows) / diagonal_of(surface)


def main(draws: int = 3) -> None:
    print("surface    turn  noise   default   height    ratio")
    for surface in SURFACES:
        for turn in TURNS:
            for noise in NOISES:
                ours, height = np.median(errors(surface, turn, noise, draws), axis=0)
                print(
                    f"{surface:10} {turn:3d}  {noise:6.0e}  {ours:.2e}  {height:.2e}"
                    f"  {ours / height:6.3f}",
                    flush=True,
                )


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
