"""Fit a cone to samples, started from the axis that normals of a quadric meet."""

from collections.abc import Iterator

import numpy as np

from touchatlas.atlas.pieces.about_axis import LARGEST, fit_about_axis, meridian, revolution_axes
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.linear_fit import frame_of, linear_fit
from touchatlas.atlas.pieces.piece import Piece


def fit_cone(points, normals, std) -> Piece | None:
    """The cone that fits samples (n, 3) best; None where none follows them, or where its apex or
    bend is beyond what they show."""
    return fit_about_axis(Kind.CONE, points, normals, std, _starts, _is_cone)


def _is_cone(cone) -> bool:
    """Whether samples show the bend of a cone, and that it narrows."""
    sine, cosine = np.sin(np.abs(cone[6])), np.cos(cone[6])
    near = np.linalg.norm(cone[:3]) < LARGEST
    return bool(near and sine * LARGEST > 1.0 and cosine * LARGEST > 1.0)


def _starts(points, normals, noise) -> Iterator[np.ndarray]:
    """Cones (7,) about the axes that normals of a quadric through points (n, 3) meet: the line of
    their distances from an axis over their heights along it."""
    frame = frame_of(points, normals)
    quadric = linear_fit(Kind.QUADRIC, points, *frame, noise)
    for axis, point in revolution_axes(points, quadric.at(points)[1]):
        rho, height = meridian(points, axis, point)
        columns = np.stack([height, np.ones(len(height))], axis=1)
        slope, level = np.linalg.lstsq(columns, rho, rcond=None)[0]
        if abs(slope) * LARGEST > 1.0:
            apex = point - level / slope * axis
            yield np.concatenate([apex, np.sign(slope) * axis, [np.arctan(abs(slope))]])
