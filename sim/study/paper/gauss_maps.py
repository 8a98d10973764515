"""What the penalty does to the Gauss map of the neck's patch: the paper's figure 4 in numbers."""

import numpy as np

from touchatlas.patch import Patch
from touchatlas.patch.paper.gauss_map import GaussMap, gauss_map
from touchatlas.sim.study.paper.fits import (
    DATA,
    DESCENT,
    PLAIN,
    contours_of,
    fitted,
    fold_of,
    spreads,
)
from touchatlas.sim.study.paper.scenes import Place, neck, plan_at, touches

# Newton's, from a patch that is near to the surface.
_STEPS = 8


def gauss_map_of(patch: Patch, contours) -> GaussMap:
    """Gauss map of a patch of ``fit_paper`` over the hull of its projected curves."""
    return gauss_map(*fold_of(patch, contours))


def true_areas(place: Place, patch: Patch, contours) -> dict[str, float]:
    """Areas of the Gauss map of the object itself over the same domain, steradian."""
    problem, coefficients = fold_of(patch, contours)
    normal = patch.frame.normal
    points = patch.frame.to_world(gauss_map(problem, coefficients).points_local)
    for _ in range(_STEPS):
        value, gradient = place.surface.field.first_order(points)
        points = points - (value / (gradient @ normal))[:, None] * normal
    k1, k2, _ = place.surface.principal_curvatures(points)
    area = k1 * k2 * problem.spacing**2 / (place.surface.normal(points) @ normal)
    return {"algebraic": float(area.sum()), "absolute": float(np.abs(area).sum())}


def gauss_maps(draws: int, rng: np.random.Generator) -> dict[str, dict]:
    """Algebraic and absolute area of the Gauss map by (3), by (5) and of the object, steradian."""
    place, three = neck(), range(len(DATA))
    found: dict[str, list[dict[str, float]]] = {PLAIN: [], DESCENT: [], "exact": []}
    for touch in touches(place, plan_at(place, len(three)), draws, rng):
        contours = contours_of(touch, three)
        for fit in (PLAIN, DESCENT):
            patch = fitted(fit, touch, three)
            areas = gauss_map_of(patch, contours)
            found[fit].append({"algebraic": areas.algebraic_area, "absolute": areas.absolute_area})
        # Of both patches the one near to the surface.
        found["exact"].append(true_areas(place, patch, contours))
    return {name: spreads(measures) for name, measures in found.items()}
