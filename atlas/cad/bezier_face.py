"""Bezier faces: trimmed patches in the form that CAD systems store.

A patch in its own frame is (x, y, z(x, y)). Over a rectangle its height is a tensor polynomial:
exactly without terms in z, else to a tolerance. The shared side of two faces lies midway between
them, and its feet on each surface trim that surface.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.cad.bezier import bernstein, curve_poles, fitting_height, tensor_height
from touchatlas.atlas.cad.trim_curves import ARC_DEGREE
from touchatlas.atlas.cad.trimmed_patches import TrimmedPatch

# How far the rectangle exceeds the cell on each side, over the cell's width: no side of the cell
# then lies on the border by rounding. Doubled, heights are fitted a little farther out.
_MARGIN = 0.01
# Points along each side, and steps from the origin to each of them, at which heights and gaps are
# compared. Doubled, each takes twice the time.
_ON_SIDE, _INWARD = 33, 8
# Factor on the largest distance found on a side, no unit, since the largest of 33 may be missed by
# 1 %. With twice the excess the tolerances in the file are 1 % larger.
_GAP_FACTOR = 1.01


@dataclass(frozen=True, eq=False)
class BezierFace:
    """A trimmed patch as a tensor Bezier surface, each parameter from 0 to 1 over a rectangle.

    Parameters
    ----------
    face : TrimmedPatch
    low, high : (2,) float, length, local
        Corners of the rectangle.
    height : (d + 1, d + 1) float, length, local
        Poles of the height, x first.
    error : float, length
        Largest difference from the patch's height on the cell.
    gaps : (sides,) float, length
        Largest distance of each side from its trace on the surface.
    """

    face: TrimmedPatch
    low: np.ndarray
    high: np.ndarray
    height: np.ndarray
    error: float
    gaps: np.ndarray

    @property
    def poles(self) -> np.ndarray:
        """(d + 1, d + 1, 3) poles, length, world; those of x and y are evenly spaced."""
        parameter = np.linspace(0.0, 1.0, len(self.height))[:, None]
        x, y = (self.low + (self.high - self.low) * parameter).T
        local = np.stack([*np.meshgrid(x, y, indexing="ij"), self.height], axis=-1)
        return self.face.patch.frame.to_world(local.reshape(-1, 3)).reshape(local.shape)

    @property
    def traces(self) -> list[np.ndarray]:
        """(9, 2) poles of each side in the surface's parameters."""
        return [(curve_poles(t) - self.low) / (self.high - self.low) for t in self.face.traces]


def bezier_face(face: TrimmedPatch, tolerance: float) -> BezierFace | None:
    """The Bezier surface of a trimmed patch, of the least degree whose height is within
    ``tolerance``; None where the patch stands upright within its cell."""
    along = bernstein(ARC_DEGREE, np.linspace(0.0, 1.0, _ON_SIDE))
    rim = np.concatenate([along @ curve_poles(trace) for trace in face.traces])
    margin = _MARGIN * np.ptp(rim, axis=0)
    low, high = rim.min(axis=0) - margin, rim.max(axis=0) + margin
    within = np.concatenate([fraction * rim for fraction in np.linspace(0.0, 1.0, _INWARD)])
    if np.isnan(face.patch.polynomial.height(within)).any():
        return None
    height, error = fitting_height(face.patch.polynomial, low, high, within, tolerance)
    on_surface = np.column_stack([rim, tensor_height(height, low, high, rim)])
    sides = np.concatenate([along @ curve_poles(side.points) for side in face.sides])
    off = np.linalg.norm(face.patch.frame.to_world(on_surface) - sides, axis=1)
    gaps = _GAP_FACTOR * off.reshape(-1, _ON_SIDE).max(axis=1)
    return BezierFace(face, low, high, height, error, gaps)
