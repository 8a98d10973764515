"""Principal curvatures as the paper estimates them: its ellipsoid (figure 6) and its sphere."""

import numpy as np

from touchatlas.patch.geometry.curvature import curvatures_from_sections, normal_from_tangents
from touchatlas.patch.geometry.frame import any_tangent, axes_from_normal
from touchatlas.patch.geometry.section import fit_sections
from touchatlas.sim.study.paper.fits import (
    CURVES,
    DATA,
    DESCENT,
    OURS,
    contours_of,
    fitted,
    judged,
    spread,
    spreads,
)
from touchatlas.sim.study.paper.scenes import NOISE, ball, plan_at, quadrant, touches

# Chosen points along the quadrant; neighbours of each on an arm, so nine points a curve.
QUADRANT_POINTS, _NEIGHBOURS = 9, 4
# The paper's ellipsoid has no unit: as large as its robot's accuracy in millimetres, and less.
QUADRANT_NOISES = (NOISE, 0.1 * NOISE)
PAPER_SPHERE = {
    "normal_curvatures": [-0.0299, -0.0307, -0.0305],
    "k1": -0.0299,
    "k2": -0.0309,
}


def section_curvatures(touch, curves=DATA) -> tuple[np.ndarray, float, float]:
    """Normal curvatures (m,) of sections, and k1 and k2 from them, 1/length.

    Notes
    -----
    The paper, section 2.1: a quadratic along each curve, the normal from the tangents, Meusnier,
    Euler.
    """
    contours = contours_of(touch, curves)
    sections = fit_sections(touch.contact, contours, contours[0].noise_std)
    tangents = np.array([section.tangent for section in sections])
    normal = normal_from_tangents(tangents, touch.approach)
    e1, e2, _ = axes_from_normal(normal, any_tangent(normal))
    along_normal = np.array([section.curvature_vector for section in sections]) @ normal
    angles = np.arctan2(tangents @ e2, tangents @ e1)
    stds = [section.curvature_std for section in sections]
    k1, k2, *_ = curvatures_from_sections(along_normal, angles, stds)
    return along_normal, k1, k2


def ellipsoid(draws: int, rng: np.random.Generator) -> list[dict]:
    """k1 and k2 at points along the ellipsoid's quadrant, by both ways, beside the exact ones."""
    return [
        {"noise_std": noise, **_at_place(place, noise, draws, rng)}
        for noise in QUADRANT_NOISES
        for place in quadrant(QUADRANT_POINTS)
    ]


def _at_place(place, noise: float, draws: int, rng) -> dict:
    three = range(len(DATA))
    plan = plan_at(place, len(three), _NEIGHBOURS)
    visits = list(touches(place, plan, draws, rng, noise))
    ours = [fitted(OURS, touch, three).curvatures for touch in visits]
    return {
        "point": place.point.tolist(),
        "arm_length": plan.reach,
        "exact": {"k1": place.k1, "k2": place.k2},
        "sections": _pair_spreads([section_curvatures(touch, three)[1:] for touch in visits]),
        OURS: _pair_spreads([(known.k1, known.k2) for known in ours]),
    }


def _pair_spreads(pairs) -> dict[str, dict]:
    return spreads([{"k1": k1, "k2": k2} for k1, k2 in pairs])


def sphere(draws: int, rng: np.random.Generator) -> dict:
    """Curvatures of the sphere of radius 33 from its sections, and errors of two patches."""
    place = ball()
    plan = plan_at(place, CURVES)
    visits = list(touches(place, plan, draws, rng))
    found = [section_curvatures(touch) for touch in visits]
    return {
        "arm_length": plan.reach,
        "exact": place.k1,
        "normal_curvatures": [spread(column) for column in np.array([f[0] for f in found]).T],
        **_pair_spreads([f[1:] for f in found]),
        "patches": {
            fit: spreads([judged(fit, touch) for touch in visits]) for fit in (DESCENT, OURS)
        },
        "paper": PAPER_SPHERE,
    }
