"""Triangles of the surface f = 0: marching cubes on the grid cells that the surface may cross.

A fine grid of n cells along each axis has n^3 cells, but the surface crosses only about n^2 of
them. So the grid is first divided into blocks; a block that the surface cannot reach is left out,
and the others are halved until single cells remain.
"""

import igl
import numpy as np

from touchatlas.sim.world.implicit_fields import Field

# The corners of a cell in the order of igl.marching_cubes.
_CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)


def level_set_mesh(field: Field, half_extent, edge: float):
    """Triangles of f = 0 within a box about the origin, by marching cubes.

    Parameters
    ----------
    field : Field
    half_extent : (3,) float, length
    edge : float, length
        Side of a grid cell.

    Returns
    -------
    vertices : (v, 3) float, length
        On the surface up to rounding.
    faces : (f, 3) int
        Counter-clockwise when seen from outside.

    Notes
    -----
    Lorensen and Cline, Marching cubes, SIGGRAPH 1987. Vertices and faces are those that the full
    grid gives, in the same order.
    """
    axes = [np.arange(-h - 1.5 * edge, h + 2.5 * edge, edge) for h in half_extent]
    # The Taylor polynomial of second order holds within an eighth of the thinnest half extent.
    start = max(int(0.125 * min(half_extent) / edge), 1)
    cells = _cells_near_surface(field, axes, edge, 1 << (start.bit_length() - 1))
    counts = np.array([len(axis) for axis in axes])
    # Grid points are numbered with x running fastest, as igl.marching_cubes goes through them.
    strides = np.array([1, counts[0], counts[0] * counts[1]])
    corners = np.sort(cells @ strides)[:, None] + _CORNERS @ strides
    is_used = np.zeros(counts.prod(), bool)
    is_used[corners] = True
    used = np.flatnonzero(is_used)
    places = np.unravel_index(used, counts, order="F")
    grid = np.stack([axis[place] for axis, place in zip(axes, places, strict=True)], axis=1)
    values = _in_batches(lambda points: field.first_order(points)[0], grid)
    # A table is read in an eighth of the time that a search takes.
    number = np.empty(counts.prod(), np.int32)
    number[used] = np.arange(len(used))
    vertices, faces, _ = igl.marching_cubes(values, grid, number[corners].astype(np.int64))
    return newton_projection(field, vertices), faces


def newton_projection(field: Field, points) -> np.ndarray:
    """(n, 3) points moved onto f = 0 along the gradient, by Newton's method."""

    def project(points):
        # Each step squares the error: six leave rounding.
        for _ in range(6):
            value, gradient = field.first_order(points)
            points = points - (value / (gradient**2).sum(axis=1))[:, None] * gradient
        return points

    return _in_batches(project, points)


def _cells_near_surface(field: Field, axes, edge: float, size: int) -> np.ndarray:
    """(c, 3) indices of the grid cells that the surface may cross.

    ``size`` is the number of cells along a first block, a power of two.
    """
    last = np.array([len(axis) - 1 for axis in axes])
    low = np.array([axis[0] for axis in axes])
    counts = -(-last // size)
    blocks = size * np.stack(np.unravel_index(np.arange(counts.prod()), counts), axis=1)
    while size > 1:
        centres = low + edge * (blocks + 0.5 * size)
        near = _in_batches(lambda p, s=size: _may_cross(field, p, 0.75**0.5 * s * edge), centres)
        size //= 2
        blocks = (blocks[near][:, None] + size * _CORNERS).reshape(-1, 3)
        blocks = blocks[(blocks < last).all(axis=1)]
    return blocks


def _may_cross(field: Field, centres, radius: float) -> np.ndarray:
    """(n,) whether f may vanish within balls: |f| <= |grad f| r + |H| r^2.

    Taylor's polynomial bounds the change of f by |grad f| r + |H| r^2 / 2; the Hessian counts
    twice, for the terms of third order.
    """
    value, gradient, hessian = field(centres)
    slope = np.sqrt((gradient**2).sum(axis=1))
    bend = np.sqrt((hessian**2).sum(axis=(1, 2)))
    return np.abs(value) <= slope * radius + bend * radius**2


def _in_batches(function, points) -> np.ndarray:
    """What a function of points (n, 3) gives, a batch at a time."""
    # A field's temporary arrays of 4,096 points stay in the processor's cache.
    if len(points) <= 4096:
        return function(points)
    parts = [points[i : i + 4096] for i in range(0, len(points), 4096)]
    return np.concatenate([function(part) for part in parts])
