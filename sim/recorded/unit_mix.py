"""One curve in another unit than the others: how it shows, and what it leaves uncertain."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from touchatlas.atlas.body.other_unit import UNIT_RATIOS
from touchatlas.patch import Patch
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.sim.recorded.curves import Curve


class OtherUnit(NamedTuple):
    """A curve or file that is in another unit: its name, its place, and the factor by which it is
    like the others."""

    name: str
    place: int
    factor: float

    @property
    def words(self) -> str:
        """What is to be seen, and what to do."""
        large = max(self.factor, 1.0 / self.factor)
        of = f"1/{large:g} of" if self.factor > 1.0 else f"{large:g} times"
        way = "multiply it by" if self.factor > 1.0 else "divide it by"
        return (
            f"{self.name} may be in another unit: the spacing of its points and its length are "
            f"about {of} those of the others; {way} {large:g} if so"
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
    OtherUnit(name="curve 'b'", place=1, factor=25.4)
    """
    long = [curve for curve in curves if curve.name and len(curve.points) >= LEAST_POINTS]
    if len(long) < 3:
        return None
    sizes = np.log([_sizes(curve.points) for curve in long])
    for i, curve in enumerate(long):
        others = np.delete(sizes, i, axis=0)
        # The others are of one unit.
        if np.ptp(others[:, :2], axis=0).max() <= np.log(UNIT_RATIOS[0]) and (
            factor := _unit_between(sizes[i], np.median(others, axis=0))
        ):
            return OtherUnit(f"curve {curve.name!r}", curves.index(curve), factor)
    return None


def other_file(files: Sequence[tuple[str, list[Curve]]]) -> OtherUnit | None:
    """The file, by name, whose curves differ from those of the others as units do."""
    named = [
        (name, [c for c in curves if c.name and len(c.points) >= LEAST_POINTS])
        for name, curves in files
    ]
    sizes = [np.log([_sizes(c.points) for c in curves]) for _, curves in named if curves]
    names = [name for name, curves in named if curves]
    for i in range(len(sizes) if len(sizes) > 1 else 0):
        others = np.concatenate(sizes[:i] + sizes[i + 1 :])
        if factor := _unit_between(np.median(sizes[i], axis=0), np.median(others, axis=0)):
            return OtherUnit(names[i], i, factor)
    return None


def _unit_between(one, others) -> float | None:
    """The ratio of units by which one curve (3,) differs from others (3,), by logarithms of their
    sizes as of ``_sizes``; None where they do not differ so."""
    gap = others - one
    if gap[0] * gap[1] <= 0.0:
        return None
    nearest = int(np.abs(np.log(UNIT_RATIOS) - np.abs(gap[:2]).mean()).argmin())
    factor = UNIT_RATIOS[nearest]
    # Recordings of one surface vary by as much.
    if np.abs(np.abs(gap[:2]) - np.log(factor)).max() > np.log(1.3):
        return None
    # Scatter below 1e-5 of the length is rounding.
    known = min(np.exp(size[2] - size[1]) for size in (one, others)) > 1e-5
    if known and gap[2] * np.sign(gap[0]) < 0.5 * np.log(factor):
        return None
    return factor if gap[0] > 0.0 else 1.0 / factor


def _sizes(points) -> tuple[float, float, float]:
    """Median spacing, length, and root mean square distance from its best plane, of a curve."""
    step = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    centred = points - points.mean(axis=0)
    across = np.linalg.svd(centred, compute_uv=False)[-1] / np.sqrt(len(points))
    tiny = np.finfo(float).tiny
    return max(float(np.median(step)), tiny), max(float(step.sum()), tiny), max(across, tiny)


def rescaled(curves: list[Curve], other: OtherUnit) -> list[Curve]:
    """The curves, with one of them in the unit of the others."""
    curve = curves[other.place]
    mended = replace(curve, points=other.factor * curve.points)
    return [mended if one is curve else one for one in curves]


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
