"""Contours of surfaces whose curvatures are known in closed form."""

from dataclasses import replace

import numpy as np

from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane

BALL_RADIUS = 33.0
UP, ORIGIN = np.array([0.0, 0.0, 1.0]), np.zeros(3)


def graph_contours(height, reach, count, noise_std, rng, angles=None, tilt=0.0):
    """Contours through the origin of the graph z = height(x, y), in planes at ``angles``.

    Each plane contains the z axis, or leans from it by ``tilt`` rad across its own direction.
    Points are even in the in-plane abscissa.
    """
    angles = np.pi / 3 * np.arange(3) if angles is None else angles
    contours = []
    for angle in angles:
        direction = np.array([np.cos(angle), np.sin(angle), 0.0])
        side = np.array([-np.sin(angle), np.cos(angle), 0.0])
        up = np.cos(tilt) * np.array([0.0, 0.0, 1.0]) + np.sin(tilt) * side
        s = np.linspace(-reach, reach, count)
        points = s[:, None] * direction
        for _ in range(60):
            rise = (height(points[:, 0], points[:, 1]) - points[:, 2]) / np.cos(tilt)
            if not rise.any():
                break
            points = points + rise[:, None] * up
        points = points + noise_std * rng.normal(size=points.shape)
        plane = SamplingPlane(np.zeros(3), np.cross(direction, up))
        contours.append(Contour(points, plane, noise_std, (ContourEnd.LENGTH_REACHED,) * 2))
    return tuple(contours)


def ball_height(x, y):
    """Top of a ball, its highest point at the origin."""
    return np.sqrt(BALL_RADIUS**2 - x * x - y * y) - BALL_RADIUS


def quadric_height(k1, k2, angle=0.0):
    """z = (k1 u^2 + k2 v^2)/2 with u at ``angle`` from x."""

    def height(x, y):
        u = np.cos(angle) * x + np.sin(angle) * y
        v = -np.sin(angle) * x + np.cos(angle) * y
        return 0.5 * (k1 * u * u + k2 * v * v)

    return height


def moved(contours, rotation, shift, scale=1.0):
    """The contours after x -> scale (rotation x) + shift."""
    return tuple(
        replace(
            c,
            points=scale * c.points @ rotation.T + shift,
            plane=SamplingPlane(
                scale * rotation @ c.plane.point + shift, rotation @ c.plane.normal
            ),
            noise_std=scale * c.noise_std,
            normals=None if c.normals is None else c.normals @ rotation.T,
        )
        for c in contours
    )


def moved_touch(touch, rotation, shift, scale=1.0):
    """The touch after x -> scale (rotation x) + shift."""
    lengths = ("tracked_length", "travel_length", "tip_radius", "systematic_std")
    return replace(
        touch,
        contact=scale * rotation @ touch.contact + shift,
        approach=rotation @ touch.approach,
        contours=moved(touch.contours, rotation, shift, scale),
        way=None if touch.way is None else scale * touch.way @ rotation.T + shift,
        **{name: scale * getattr(touch, name) for name in lengths},
    )


def scaled(touch, scale: float):
    """The touch in another unit."""
    return moved_touch(touch, np.eye(3), np.zeros(3), scale)
