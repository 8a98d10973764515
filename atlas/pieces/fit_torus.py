"""Fit a torus to samples, started from the axis that normals of a quartic meet."""

from collections.abc import Iterator

import numpy as np

from touchatlas.atlas.pieces.about_axis import LARGEST, fit_about_axis, meridian, revolution_axes
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.linear_fit import frame_of, linear_fit
from touchatlas.atlas.pieces.piece import Piece

# Parts of the samples, those nearest to the middle, whose normals give a start: a quartic does not
# follow a whole tube, and those of a small part tell the axis badly.
_PARTS = 1.0, 0.5, 0.25


def fit_torus(points, normals, std) -> Piece | None:
    """The torus that fits samples (n, 3) best; None where none follows them."""
    return fit_about_axis(Kind.TORUS, points, normals, std, _starts, _is_ring)


def _is_ring(torus) -> bool:
    """Whether the tube leaves a hole, and samples show the bend of both radii."""
    return bool(abs(torus[7]) < torus[6] < LARGEST and abs(torus[7]) * LARGEST > 1.0)


def _starts(points, normals, noise) -> Iterator[np.ndarray]:
    """Tori (8,) about the axes that normals of quartics through parts of points (n, 3) meet."""
    order = np.argsort((points * points).sum(axis=1), kind="stable")
    for part in _PARTS:
        count = int(part * len(points))
        if count < Kind.QUARTIC.parameters:
            break
        some = np.sort(order[:count])
        frame = frame_of(points[some], normals[some])
        quartic = linear_fit(Kind.QUARTIC, points[some], *frame, noise[some])
        for axis, point in revolution_axes(points[some], quartic.at(points[some])[1]):
            yield _about(points[some], axis, point)


def _about(points, axis, point) -> np.ndarray:
    """The torus (8,) about an axis whose section fits points (n, 3) best: the circle (Kasa 1976)
    of their distances from the axis and heights along it."""
    rho, height = meridian(points, axis, point)
    columns = np.stack([rho, height, np.ones(len(rho))], axis=1)
    a, b, c = np.linalg.lstsq(columns, rho**2 + height**2, rcond=None)[0]
    ring, level = 0.5 * a, 0.5 * b
    tube = np.sqrt(max(c + ring**2 + level**2, 0.0))
    return np.concatenate([point + level * axis, axis, [ring, tube]])
