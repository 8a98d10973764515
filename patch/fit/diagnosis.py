"""diagnose: how far a patch can be trusted, and what to do where it cannot."""

from dataclasses import dataclass, fields

import numpy as np

from touchatlas.patch.fit.advice import advice_on
from touchatlas.patch.fit.crossings import MISSED, crossings, displaced_curves
from touchatlas.patch.fit.curve_tests import excess_scatter
from touchatlas.patch.fit.residual_tests import residual_tests
from touchatlas.patch.geometry.contour import Contour, check_contours
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import (
    SECOND_ORDER,
    evaluate,
    gaussian_curvature,
    graph_derivatives,
    scaled_height,
)

# Condition of the sections above which curvatures are doubtful: 1.4 for planes 60 degrees apart,
# 30 for planes within 15 degrees. Below, predicted deviations hold what it does. Doubled, planes
# within 11 degrees pass.
_POOR_CONDITION = 30.0
# Largest fraction of outliers that a patch bears. Doubled, one bad contact in ten is no doubt.
_OUTLIERS = 0.05
# Tests at this many standard deviations: one false alarm in a thousand good patches. Doubled, only
# gross misfits are doubted.
_LIMIT = 3.3
# Largest serial correlation. A fit leaves residuals that alternate, by one deviation: the limit is
# about 3.5 deviations above what good patches have. Doubled, drift passes twice as far.
_WAVES = 2.3
# Least core over the reach of the longest curve. Doubled, a core of a tenth is doubted.
_SMALL = 0.05
# Residuals below this fraction of the noise: it is not the noise of these points. Doubled, good
# fits of many terms are doubted.
_TOO_NOISY = 1.0 / 3.0
# Largest deviation at the core's rim over the core radius: a slope of 3.4 degrees. Doubled,
# patches pass that hardly know more than their tangent plane.
_UNCERTAIN = 0.06
# Rounding of exact contacts over the radius: the fit takes noise to be no less.
_ROUNDING = 1e-6
# Largest root mean square distance of a curve from its plane, in noises, and over its size where
# there is less noise than that. Doubled, planes off by twice the angle pass.
_OFF_PLANE, _OFF_PLANE_FRACTION = 2.0, 1e-3
# Largest ratio of the spacings of two curves' samples. Doubled, a curve in a unit eight times as
# large passes.
_UNLIKE = 5.0
# Directions of the rim that are compared, 7.5 degrees apart.
_RIM = np.pi / 24.0 * np.arange(48)
# Radii of the grid on which the sign of K is read, over the core radius.
_RINGS = np.array([0.25, 0.5, 0.75, 1.0])


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What is doubtful about a patch, and the numbers behind it.

    Parameters
    ----------
    doubts : tuple of str
        Keys of ADVICE; empty where no test fails.
    condition : float
        Condition number of the sections.
    weakest_direction : (3,) float, unit, world
        Tangent direction in which the rim of the core is least certain.
    weakest_deviation : float, length
        Standard deviation of the patch there.
    leverage : float
        Its square over that of the noise: above 1 the place is extrapolated.
    residual_ratio : float
        Root mean square of the residuals over their deviations; outliers are left out.
    serial : float
        Serial correlation of the residuals along the contours, in its standard deviations.
    disagreement : float
        How far the curves disagree on the surface where they cross, in standard deviations.
    miss : float
        Largest distance of two curves where their planes cross, in standard deviations.
    displaced : tuple of int
        Indices of the curves that lie beside the others; empty where it cannot be told which do.
    sign_changes : float
        Fraction of the core where the Gaussian curvature has another sign than at the origin.
    outliers : float
        Fraction of the samples that are five deviations off.
    off_plane : float
        Largest root mean square distance of a curve from its plane, in its noise.
    unlike : float
        Largest ratio of the median spacings of two curves' samples.
    scatter : float
        How much more one curve scatters across its own plane than the others, in deviations.
    """

    doubts: tuple[str, ...]
    condition: float
    weakest_direction: np.ndarray
    weakest_deviation: float
    leverage: float
    residual_ratio: float
    serial: float
    disagreement: float
    miss: float
    displaced: tuple[int, ...]
    sign_changes: float
    outliers: float
    off_plane: float
    unlike: float
    scatter: float

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do about the doubts, a sentence each."""
        return advice_on(self.doubts, tuple(f"{i} (counted from 0)" for i in self.displaced))

    def as_dict(self) -> dict:
        """All numbers and sentences, ready for JSON."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        plain = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in values.items()}
        lists = {name: list(getattr(self, name)) for name in ("doubts", "displaced", "advice")}
        return plain | lists


def diagnose(patch: Patch, contours: tuple[Contour, ...]) -> Diagnosis:
    """The diagnosis of a patch against contours of its surface.

    Parameters
    ----------
    patch : Patch
    contours : tuple of Contour
        Those it was fitted to, or others. Only samples within the patch radius are compared.

    Raises
    ------
    ValueError
        When the arguments are no Patch and no contours.

    Notes
    -----
    Each test fails for about one good patch in a thousand.

    Examples
    --------
    Exact curves of a paraboloid, of which the third is stated in another plane:

    >>> from touchatlas.patch import ContourEnd, SamplingPlane, fit_patch
    >>> s, ends = np.linspace(-1.0, 1.0, 21)[:, None], (ContourEnd.LENGTH_REACHED,) * 2
    >>> def curve(angle, plane):
    ...     along = np.array([np.cos(angle), np.sin(angle), 0.0])
    ...     normal = np.array([-np.sin(plane), np.cos(plane), 0.0])
    ...     points = s * along - 0.3 * s**2 * [0.0, 0.0, 1.0]
    ...     return Contour(points, SamplingPlane(np.zeros(3), normal), 1e-3, ends)
    >>> curves = curve(0.0, 0.0), curve(1.0, 1.0), curve(2.0, 2.0)
    >>> up = np.array([0.0, 0.0, 1.0])
    >>> "off plane" in diagnose(fit_patch(np.zeros(3), curves, up).patch, curves).doubts
    False
    >>> curves = *curves[:2], curve(2.0, 2.1)
    >>> "off plane" in diagnose(fit_patch(np.zeros(3), curves, up).patch, curves).doubts
    True
    """
    if not isinstance(patch, Patch):
        raise ValueError(
            f"got {type(patch).__name__} for the patch; give a Patch, as the patch of a PatchFit is"
        )
    check_contours(contours)
    noise = max(patch.noise_std, _ROUNDING * patch.radius)
    core, tests = patch.core * patch.radius, residual_tests(patch, contours)
    direction, deviation = _weakest(patch)
    scatter = excess_scatter(contours)
    off_plane, unlike = max(_off_plane(contour) for contour in contours), _spacing_ratio(contours)
    found = crossings(contours, patch.frame.origin, _ROUNDING * patch.radius)
    miss = max((crossing.miss for crossing in found), default=0.0)
    contradicts = tests.disagreement > _LIMIT or miss > MISSED or tests.left_out
    # Without noise the residuals are what the patch leaves out, and have no law.
    noisy = noise > 10.0 * _ROUNDING * patch.radius
    failed = {
        "poor sections": patch.condition > _POOR_CONDITION,
        "uncertain": deviation > _UNCERTAIN * core,
        "small": core < _SMALL * _longest_reach(patch, contours),
        "misfit": tests.excess > _LIMIT,
        "waves": tests.serial > _WAVES and noisy,
        "contradiction": contradicts and noisy,
        "off plane": off_plane > _OFF_PLANE,
        "unlike curves": unlike > _UNLIKE or (scatter > _LIMIT and noisy),
        "bad contacts": tests.outliers > _OUTLIERS,
        "noise overstated": tests.ratio < _TOO_NOISY and noisy,
    }
    return Diagnosis(
        doubts=tuple(name for name, holds in failed.items() if holds),
        condition=float(patch.condition),
        weakest_direction=direction,
        weakest_deviation=deviation,
        leverage=(deviation / noise) ** 2,
        residual_ratio=tests.ratio,
        serial=tests.serial,
        disagreement=tests.disagreement,
        miss=miss,
        displaced=displaced_curves(found, len(contours)) if noisy else (),
        sign_changes=_sign_changes(patch),
        outliers=tests.outliers,
        off_plane=off_plane,
        unlike=unlike,
        scatter=scatter,
    )


def _off_plane(contour: Contour) -> float:
    """Root mean square distance of a curve from its plane, in noises.

    Medians, which single bad contacts hardly change: 1.48 makes a deviation of a median.
    """
    off = np.abs((contour.points - contour.plane.point) @ contour.plane.normal)
    size = float(np.ptp(contour.points, axis=0).max())
    return 1.48 * float(np.median(off)) / max(contour.noise_std, _OFF_PLANE_FRACTION * size, 1e-300)


def _longest_reach(patch: Patch, contours) -> float:
    """Distance of the farthest sample from the origin of the patch."""
    offsets = [c.points - patch.frame.origin for c in contours]
    return float(np.sqrt(max((o * o).sum(axis=1).max() for o in offsets)))


def _spacing_ratio(contours) -> float:
    """Largest over smallest median distance of neighbouring samples of the curves."""
    steps = [np.diff(c.points, axis=0) for c in contours]
    spacing = [float(np.median(np.sqrt((d * d).sum(axis=1)))) for d in steps if len(d)]
    return max(spacing, default=1.0) / max(min(spacing, default=1.0), 1e-300)


def _weakest(patch: Patch) -> tuple[np.ndarray, float]:
    """Direction (3,), world, in which the core's rim is least certain, and the deviation there."""
    flat = patch.core * patch.radius * np.stack([np.cos(_RIM), np.sin(_RIM)], axis=1)
    height = np.nan_to_num(patch.polynomial.height(flat))
    deviation = patch.deviation(patch.frame.to_world(np.column_stack([flat, height])))
    worst = int(deviation.argmax())
    direction = (
        np.cos(_RIM[worst]) * patch.frame.axes[0] + np.sin(_RIM[worst]) * patch.frame.axes[1]
    )
    return direction, float(deviation[worst])


def _sign_changes(patch: Patch) -> float:
    """Fraction of the core where K has another sign than at the origin."""
    r, angle = np.meshgrid(patch.core * np.sqrt(_RINGS), _RIM)
    x, y = np.append(0.0, r * np.cos(angle)), np.append(0.0, r * np.sin(angle))
    basis, coefficients = patch.polynomial.basis, patch.polynomial.coefficients
    z = np.nan_to_num(scaled_height(basis, coefficients, x, y))
    derivatives = evaluate(basis, coefficients, x, y, z, SECOND_ORDER)
    k = gaussian_curvature(*graph_derivatives(*derivatives))
    return float(np.mean(k[1:] * k[0] < 0.0))
