"""What the patches expect of their own errors."""

import numpy as np

from touchatlas.atlas.patches.patch_table import PatchTable
from touchatlas.patch.geometry.polynomial import monomials

_HALF_WAY = 0.5


def half_way_deviation(table: PatchTable, rows: np.ndarray) -> float:
    """Root mean square over rows of their standard deviation half-way to the rim, length."""
    angles = np.pi / 4.0 * np.arange(8) + 0.2
    x, y = _HALF_WAY * np.cos(angles), _HALF_WAY * np.sin(angles)
    # The height by its curvature alone: it matters little here.
    z = np.stack([x * x, x * y, y * y]).T @ table.mean[rows, 3:6, None]
    x, y, z = np.broadcast_arrays(x, y, z[..., 0])
    terms = monomials(table.basis, x, y, z)[: table.basis.size].transpose(1, 0, 2)
    variance = table.variance_at(rows, terms).mean(axis=1)
    return float(np.sqrt(np.mean(table.radius[rows] ** 2 * variance)))
