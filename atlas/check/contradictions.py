"""Samples that contradict patches, and the move of the object that explains them."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.field.patch_values import PatchValues
from touchatlas.atlas.state import AtlasState

# Distance of a contradicting sample from a patch, in deviations of both. Doubled, an object that
# moved by ten deviations passes.
_DEVIATIONS = 5.0
# Fraction of a patch radius beyond which a sample is no sample of that patch's surface. Doubled,
# the two walls of a step are compared.
_NEAR = 0.25
# Least cosine of the normals of a sample and of a patch that may contradict each other: 60 degrees.
# Doubled, a sample speaks against patches of its own sheet alone.
_ALIKE = 0.5


@dataclass(frozen=True, eq=False)
class Contradictions:
    """Pairs of a sample and a patch that claims its place and lies beside it.

    Parameters
    ----------
    sample, patch : (m,) int
    distance : (m,) float, length
        Of the sample from the patch, positive outside.
    normals : (m, 3) float, unit, world
        Of the patch.
    """

    sample: np.ndarray
    patch: np.ndarray
    distance: np.ndarray
    normals: np.ndarray


def contradictions(atlas: AtlasState, surely: bool = True) -> Contradictions:
    """The samples that lie in the core of a patch with a normal like their own, and more than five
    deviations from it; if not ``surely``, those of the noise alone. A patch that is fitted to two
    surfaces lies between them, and its deviation is as large as their distance.
    """
    table = atlas.table
    rows, which, found = claims(atlas)
    variance, normals = surely * found.numbers[:, 1], found.numbers[:, 3:]
    size = np.abs(found.distance)
    deviation = np.sqrt(variance + table.measurement_std[rows] ** 2 + atlas.bias**2)
    against = (size > _DEVIATIONS * deviation) & (size < _NEAR * table.radius[rows])
    against &= (normals * atlas.membership.pool.normals[which]).sum(axis=1) > _ALIKE
    return Contradictions(which[against], rows[against], found.distance[against], normals[against])


def claims(atlas: AtlasState) -> tuple[np.ndarray, np.ndarray, PatchValues]:
    """Pairs of a patch and a sample in its core, and the values of the patch there."""
    table, points = atlas.table, atlas.membership.pool.points
    rows, which = table.index.near(points)
    offset = points[which] - table.site[rows]
    inside = (offset * offset).sum(axis=1) <= table.weight[rows]
    rows, which = rows[inside], which[inside]
    return rows, which, atlas.field.of_patches(rows, points[which])


def shift_between(atlas: AtlasState, found: Contradictions) -> tuple[np.ndarray, float]:
    """The shift (3,) of the object during the exploration that explains contradictions best, and
    the fraction of their sum of squares that it explains.

    A sample that is later than those of the patch lies off it by n . t, an earlier one by -n . t.
    The move was larger where patches are fitted to samples of before and after it.
    """
    membership = atlas.membership
    age = {row: float(np.median(membership.fitted[row])) for row in set(found.patch.tolist())}
    later = np.sign(found.sample - np.array([age[row] for row in found.patch.tolist()]))
    distance = later * found.distance
    shift = np.linalg.lstsq(found.normals, distance, rcond=None)[0]
    left = distance - found.normals @ shift
    return shift, 1.0 - float(left @ left) / max(float(distance @ distance), 1e-300)
