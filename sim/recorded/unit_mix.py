"""One curve in another unit than the others: how it shows, and what it leaves uncertain."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from touchatlas.patch import Patch
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.sim.recorded.contour_file import Curve

# Ratios of units of length that people mix: um, mm, cm, m, inch, and mm to foot. Others lie so near
# to one of these that lengths of curves can't tell them.
_RATIOS = np.array([2.54, 10.0, 25.4, 100.0, 304.8, 1000.0, 1e6])


class OtherUnit(NamedTuple):
    """A curve, by name, that is in another unit if multiplied by a factor it is like the others."""

    name: str
    factor: float

    @property
    def words(self) -> str:
        """What is to be seen, and what to do."""
        large = max(self.factor, 1.0 / self.factor)
        of = f"1/{large:g} of" if self.factor > 1.0 else f"{large:g} times"
        way = "multiply it by" if self.factor > 1.0 else "divide it by"
        return (
            f"curve {self.name!r} may be in another unit: the spacing of its points and its length "
            f"are about {of} those of the others; {way} {large:g} if so"
        )


def other_unit(curves: list[Curve]) -> OtherUnit | None:
    """The curve whose spacing, length and scatter differ from the others' as units do.

    Noise across its plane shows the unit of a curve, too, unless it is rounding: a curve that is
    longer than the others, and sampled more coarsely, by the same probe, has the same.

    Examples
    --------
    >>> s = np.linspace(-1.0, 1.0, 21)[:, None] * [1.0, 0.0, 0.0]
    >>> curves = [Curve("a", s, None), Curve("b", s / 25.4, None), Curve("c", 1.1 * s, None)]
    >>> other_unit(curves)
    OtherUnit(name='b', factor=25.4)
    """
    long = [curve for curve in curves if curve.name and len(curve.points) >= LEAST_POINTS]
    if len(long) < 3:
        return None
    sizes = np.log([_sizes(curve.points) for curve in long])
    for i, curve in enumerate(long):
        others = np.delete(sizes, i, axis=0)
        gap = np.median(others, axis=0) - sizes[i]
        # The others are of one unit.
        if np.ptp(others[:, :2], axis=0).max() > np.log(_RATIOS[0]) or gap[0] * gap[1] <= 0.0:
            continue
        nearest = int(np.abs(np.log(_RATIOS) - np.abs(gap[:2]).mean()).argmin())
        factor = float(_RATIOS[nearest])
        # Recordings of one surface vary by as much.
        if np.abs(np.abs(gap[:2]) - np.log(factor)).max() > np.log(1.3):
            continue
        # Scatter below 1e-5 of the length is rounding.
        known = np.exp(sizes[:, 2] - sizes[:, 1]).min() > 1e-5
        if known and gap[2] * np.sign(gap[0]) < 0.5 * np.log(factor):
            continue
        return OtherUnit(curve.name, factor if gap[0] > 0.0 else 1.0 / factor)
    return None


def _sizes(points) -> tuple[float, float, float]:
    """Median spacing, length, and root mean square distance from its best plane, of a curve."""
    step = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    centred = points - points.mean(axis=0)
    across = np.linalg.svd(centred, compute_uv=False)[-1] / np.sqrt(len(points))
    tiny = np.finfo(float).tiny
    return max(float(np.median(step)), tiny), max(float(step.sum()), tiny), max(across, tiny)


def rescaled(curves: list[Curve], other: OtherUnit) -> list[Curve]:
    """The curves, with one of them in the unit of the others."""
    return [
        replace(c, points=other.factor * c.points) if c.name == other.name else c for c in curves
    ]


def holding(patch: Patch, other: Patch) -> Patch:
    """The patch, with deviations that hold another reading of the same data.

    The difference of height, slopes and curvatures is one deviation more: its dyad is added to the
    covariance.
    """
    up, axes = patch.frame.normal, patch.frame.axes[:2]
    difference = np.zeros(len(patch.covariance))
    terms = [tuple(row) for row in patch.polynomial.basis.exponents.tolist()]
    tensor = axes @ (_shape(other) - _shape(patch)) @ axes.T
    slopes = -axes @ other.frame.normal / max(abs(float(up @ other.frame.normal)), 0.1)
    height = (other.frame.origin - patch.frame.origin) @ up
    values = {
        (0, 0, 0): height / patch.radius,
        (1, 0, 0): slopes[0],
        (0, 1, 0): slopes[1],
        (2, 0, 0): 0.5 * tensor[0, 0] * patch.radius,
        (1, 1, 0): tensor[0, 1] * patch.radius,
        (0, 2, 0): 0.5 * tensor[1, 1] * patch.radius,
    }
    for term, value in values.items():
        difference[terms.index(term)] = value
    return replace(patch, covariance=patch.covariance + np.outer(difference, difference))


def _shape(patch: Patch) -> np.ndarray:
    """(3, 3) second fundamental form at the origin of a patch, world, 1 / length."""
    c = patch.curvatures
    first, second = c.directions
    return c.k1 * np.outer(first, first) + c.k2 * np.outer(second, second)
