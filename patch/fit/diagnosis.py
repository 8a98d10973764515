"""diagnose: how far a patch can be trusted, and what to do where it cannot."""

from dataclasses import dataclass, fields

import numpy as np

from touchatlas.patch.checks import check_above
from touchatlas.patch.fit.advice import advice_on
from touchatlas.patch.fit.crossings import crossings, displaced_curves
from touchatlas.patch.fit.residual_tests import excess_scatter, residual_tests
from touchatlas.patch.fit.smoothness import scaled_noise
from touchatlas.patch.geometry.contour import Contour, check_contours
from touchatlas.patch.geometry.patch import Patch
from touchatlas.patch.geometry.polynomial import (
    SECOND_ORDER,
    evaluate,
    gaussian_curvature,
    graph_derivatives,
    scaled_height,
)


@dataclass(frozen=True)
class DiagnosisLimits:
    """Numbers of a patch beyond which it is doubted: each by one good patch in a thousand.

    Parameters
    ----------
    condition : float
        Largest condition of the sections: 1.4 for planes 60 degrees apart, 30 for planes within 15
        degrees. Below, predicted deviations hold.
    outliers : float
        Largest fraction of outliers.
    sure : float
        Largest test statistic, in standard deviations.
    miss : float
        Largest distance of two curves at a crossing, in standard deviations: one of 5,000 touches
        of three curves has it.
    serial : float
        Largest serial correlation. A fit leaves residuals that alternate, by one deviation: the
        limit is about 3.5 deviations above what good patches have.
    core : float
        Least core over the reach of the longest curve.
    residual_ratio : float
        Least residuals over the noise: below, it is not the noise of these points.
    deviation : float
        Largest deviation at the core's rim over the core radius: a slope of 3.4 degrees.
    off_plane : float
        Largest root mean square distance of a curve from its plane, in its noise.
    unlike : float
        Largest ratio of the spacings of two curves' samples.
    """

    condition: float = 30.0
    outliers: float = 0.05
    sure: float = 3.3
    miss: float = 4.0
    serial: float = 2.3
    core: float = 0.05
    residual_ratio: float = 1.0 / 3.0
    deviation: float = 0.06
    off_plane: float = 2.0
    unlike: float = 5.0

    def __post_init__(self) -> None:
        check_above(self)


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
        Indices of the displaced curves; empty where the misses do not show which they are.
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


def diagnose(
    patch: Patch, contours: tuple[Contour, ...], limits: DiagnosisLimits = DiagnosisLimits()
) -> Diagnosis:
    """The diagnosis of a patch against contours of its surface.

    Parameters
    ----------
    patch : Patch
    contours : tuple of Contour
        Those it was fitted to, or others. Only samples within the patch radius are compared.
    limits : DiagnosisLimits

    Raises
    ------
    ValueError
        When the arguments are no Patch and no contours.

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
    scaled = scaled_noise(patch.noise_std, patch.radius)
    noise = scaled * patch.radius
    core, tests = patch.core * patch.radius, residual_tests(patch, contours)
    direction, deviation = _weakest(patch)
    scatter = excess_scatter(contours)
    off_plane, unlike = max(_off_plane(contour) for contour in contours), _spacing_ratio(contours)
    found = crossings(contours, patch.frame.origin, scaled_noise(0.0, patch.radius) * patch.radius)
    miss = max((crossing.miss for crossing in found), default=0.0)
    contradicts = tests.disagreement > limits.sure or miss > limits.miss or tests.left_out
    # Without noise the residuals are what the patch leaves out, and have no law.
    noisy = scaled > 1e-5
    failed = {
        "poor sections": patch.condition > limits.condition,
        "uncertain": deviation > limits.deviation * core,
        "small": core < limits.core * _longest_reach(patch, contours),
        "misfit": tests.excess > limits.sure,
        "waves": tests.serial > limits.serial and noisy,
        "contradiction": contradicts and noisy,
        "off plane": off_plane > limits.off_plane,
        "unlike curves": unlike > limits.unlike or (scatter > limits.sure and noisy),
        "bad contacts": tests.outliers > limits.outliers,
        "noise overstated": tests.ratio < limits.residual_ratio and noisy,
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
        displaced=displaced_curves(found, len(contours), limits.miss) if noisy else (),
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
    return 1.48 * float(np.median(off)) / max(contour.noise_std, 1e-3 * size, 1e-300)


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
    rim = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    around = np.stack([np.cos(rim), np.sin(rim)], axis=1)
    flat = patch.core * patch.radius * around
    height = np.nan_to_num(patch.polynomial.height(flat))
    deviation = patch.deviation(patch.frame.to_world(np.column_stack([flat, height])))
    worst = int(deviation.argmax())
    return around[worst] @ patch.frame.axes[:2], float(deviation[worst])


def _sign_changes(patch: Patch) -> float:
    """Fraction of the core where K has another sign than at the origin."""
    rings = patch.core * np.sqrt([0.25, 0.5, 0.75, 1.0])
    r, angle = np.meshgrid(rings, np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False))
    x, y = np.append(0.0, r * np.cos(angle)), np.append(0.0, r * np.sin(angle))
    basis, coefficients = patch.polynomial.basis, patch.polynomial.coefficients
    z = np.nan_to_num(scaled_height(basis, coefficients, x, y))
    derivatives = evaluate(basis, coefficients, x, y, z, SECOND_ORDER)
    k = gaussian_curvature(*graph_derivatives(*derivatives))
    return float(np.mean(k[1:] * k[0] < 0.0))
