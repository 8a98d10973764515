"""Surfaces, contours and fits that the laws of the patch share."""

from functools import cache

import numpy as np

from tests.truths import graph_contours
from touchatlas.patch import FitOptions, PatchFit, fit_patch
from touchatlas.sim.study.scenes import Scene, draw_scene

LENGTH = 20.0
MONGE = FitOptions(height_only=True, adaptive=False)
NOISE = 0.02
SMOOTH_SURFACES = ["ball", "ellipsoid", "bottle_neck", "mouse"]


class WavyGraph:
    """z = sum a (sin(w . x + p) - its tangent plane at the origin): smooth, no polynomial."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.waves = rng.normal(size=(5, 2)) / LENGTH
        self.phase = rng.uniform(0.0, 2.0 * np.pi, 5)
        self.size = 0.2 * LENGTH * rng.normal(size=5)

    def __call__(self, x, y):
        along = np.multiply.outer(x, self.waves[:, 0]) + np.multiply.outer(y, self.waves[:, 1])
        sine, cosine = np.sin(self.phase), np.cos(self.phase)
        return (np.sin(along + self.phase) - sine - cosine * along) @ self.size

    def normal_curvature(self, angle: float) -> float:
        """At the origin, exact. It is positive where the graph curves upward."""
        slope = self.waves @ [np.cos(angle), np.sin(angle)]
        return float(-(self.size * np.sin(self.phase)) @ slope**2)


def even_angles(count: int) -> np.ndarray:
    """Directions of sections, evenly spread over 180 degrees."""
    return 0.2 + np.pi / count * np.arange(count)


def contours_of(height, reach, sections=3, noise=0.0, seed=0, points=41):
    rng = np.random.default_rng(seed)
    return graph_contours(height, reach, points, noise, rng, angles=even_angles(sections))


@cache
def scene_of(
    surface: str, draw: int, sections: int = 3, noise: float = NOISE, tilt: float = 0.0
) -> Scene:
    """One scene of a surface, drawn once for all laws: to draw it takes ten times as long as to
    fit it."""
    return draw_scene(surface, noise, tilt, np.random.default_rng([sections, draw]), sections)


def fit_of(scene: Scene, contours=None, **more) -> PatchFit:
    """The default fit of a scene, or of other contours at its place."""
    return fit_patch(scene.contact, contours or scene.contours, scene.normal, **more)
