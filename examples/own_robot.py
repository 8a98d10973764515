"""Ask/tell with a probe of one's own: any function from ProbePlan to Touch will do.

Here the "robot" tracks great circles of a ball that only it knows.

    python examples/own_robot.py
"""

import numpy as np
import trimesh

from touchatlas.atlas import Atlas, Touch, TouchStatus, extract_surface
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.planner import Planner

RADIUS, NOISE = 33.0, 0.02
RNG = np.random.default_rng(0)


def robot(plan) -> Touch:
    """Come along the normal through the reference point, touch the ball, and track it in the
    planned directions."""
    off = plan.reference_point @ plan.normal
    half = off**2 - plan.reference_point @ plan.reference_point + RADIUS**2
    if half < 0.0:
        place = plan.reference_point, plan.normal
        return Touch(plan.number, *place, (), TouchStatus.NO_CONTACT, 0.0, 0.0)
    up = (plan.reference_point + (np.sqrt(half) - off) * plan.normal) / RADIUS
    reach = min(plan.reach, plan.max_turn * RADIUS)
    turn = np.arange(-int(reach / plan.step), int(reach / plan.step) + 1) * plan.step / RADIUS
    contours = []
    for plane in plan.planes:
        along = np.cross(up, plane.normal)
        along /= np.linalg.norm(along)
        arc = RADIUS * (np.outer(np.cos(turn), up) + np.outer(np.sin(turn), along))
        noisy = arc + NOISE * RNG.normal(size=arc.shape)
        section = SamplingPlane(RADIUS * up, np.cross(along, up))
        contours.append(Contour(noisy, section, NOISE, (ContourEnd.LENGTH_REACHED,) * 2))
    length = 2.0 * reach * len(contours)
    place = RADIUS * up, plan.normal
    return Touch(plan.number, *place, tuple(contours), TouchStatus.TOUCHED, length, 0.0)


def main() -> None:
    atlas = Atlas(tolerance=0.1, scale=5.0 * NOISE)
    planner = Planner(start=[0.0, 0.0, RADIUS], outward=[0.0, 0.0, 1.0])
    while (plan := planner.ask(atlas)) is not None:
        touch = robot(plan)
        planner.tell(touch, atlas.add(touch))
    atlas.finish()
    points = RNG.normal(size=(5000, 3))
    points *= RADIUS / np.linalg.norm(points, axis=1)[:, None]
    seen = atlas.blend(points)
    surface = extract_surface(atlas)
    euler = trimesh.Trimesh(surface.vertices, surface.faces, process=False).euler_number
    print(f"{atlas.touches} touches, {len(atlas)} patches, V - E + F = {euler}")
    print(
        f"known {seen.known.mean():.3f} of the ball, mean error {np.abs(seen.distance).mean():.4f}"
    )


if __name__ == "__main__":
    main()
