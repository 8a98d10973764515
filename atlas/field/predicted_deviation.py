"""Predicted deviation: how far the surface may be off, with what samples leave unexplained."""

import numpy as np

from touchatlas.atlas.field.blend import Blend
from touchatlas.atlas.patches.patch_table import PatchTable


def predicted_deviation(table: PatchTable, found: Blend) -> np.ndarray:
    """(n,) predicted deviation of the surface at the points of a blend, length; NaN where it is
    unknown.

    It is that of the polynomials, and by how much the samples of the owner lie farther off than
    their noise explains: until residuals are learned, polynomials know of no finer detail.
    """
    row = np.maximum(found.patch, 0)
    unexplained = table.residual[row] ** 2 - table.measurement_std[row] ** 2
    out: np.ndarray = np.sqrt(found.deviation**2 + np.maximum(unexplained, 0.0))
    return out
