"""What each number of ``touchatlas fit`` is, its unit, and what is good."""

from touchatlas.sim.judge.number_meanings import LENGTH, Meaning

_PER_LENGTH = f"1 / {LENGTH}"


def _m(what: str, unit: str = "–", good: str = "–") -> Meaning:
    return Meaning(what, unit, good)


FIT_NUMBERS: dict[str, Meaning] = {
    "method": _m("how the patch was fitted, as --method says"),
    "frame": _m("origin of the patch, and axes: along k1, along k2, outward normal", LENGTH),
    "terms": _m("exponents of x, y, z of each term of the polynomial, in the frame"),
    "coefficients": _m(
        "of the terms, in z = sum c x^i y^j z^k", f"{LENGTH} to the power 1 - i - j - k"
    ),
    "coefficients_std": _m(
        "standard deviations of the coefficients, apart from each other",
        "as the coefficients",
        "small beside those that matter",
    ),
    "radius": _m("the patch holds within this distance of its origin", LENGTH),
    "k1": _m("larger principal curvature at the origin, negative where it bulges", _PER_LENGTH),
    "k2": _m("smaller principal curvature at the origin", _PER_LENGTH),
    "k1_std": _m(
        "standard deviation of k1: 95 % of errors are below 1.96 of it", _PER_LENGTH, "small"
    ),
    "k2_std": _m("the same of k2", _PER_LENGTH, "small"),
    "umbilic": _m("whether k1 and k2 differ by no more than noise explains"),
    "condition": _m(
        "condition number of the directions of the curves: 1.4 for three 60 degrees apart",
        good="below 10",
    ),
    "normal_std": _m(
        "root mean square angle between the true normal and the found one", "rad", "below 0.01"
    ),
    "residual_rms": _m(
        "root mean square distance of the points from the patch, bad contacts left out",
        LENGTH,
        "the noise",
    ),
    "noise_std": _m("noise of each coordinate of each point, that the fit took", LENGTH),
    "point_noise_std": _m("the same, as --noise states or as estimated from the curves", LENGTH),
    "displacement_std": _m(
        "standard deviation of each coordinate by which each curve may be displaced as a whole",
        LENGTH,
        "0",
    ),
    "count": _m("points that were fitted", good="100 or more"),
    "outliers": _m("points that were left out as bad contacts", good="0"),
    "warnings": _m("what is probably wrong with the file", good="none"),
    "flags": _m("what is to be known of the fit", good="few"),
    "assumed": _m("what was found out about the file"),
    "diagnosis": _m("tests of the patch against the curves, below"),
}
DIAGNOSIS_NUMBERS: dict[str, Meaning] = {
    "doubts": _m("names of the tests that fail", good="none"),
    "condition": _m("condition number of the directions of the curves", good="below 30"),
    "weakest_direction": _m("tangent direction in which the rim of the core is least certain"),
    "weakest_deviation": _m(
        "standard deviation of the patch there", LENGTH, "below 0.06 core radii"
    ),
    "leverage": _m(
        "its square over that of the noise; above 1 the place is extrapolated", good="below 1"
    ),
    "residual_ratio": _m(
        "root mean square of the residuals over their standard deviations", good="1"
    ),
    "serial": _m(
        "correlation of neighbouring residuals along the curves, in its standard deviations",
        good="below 2.3",
    ),
    "disagreement": _m(
        "how far the curves disagree on the surface where they cross, in standard deviations",
        good="below 3.3",
    ),
    "miss": _m(
        "largest distance of two curves where their planes cross, in standard deviations",
        good="below 4",
    ),
    "displaced": _m("names of the curves that lie beside the others", good="none"),
    "sign_changes": _m(
        "fraction of the core where the Gaussian curvature has another sign than at the origin",
        good="0, unless the surface has such",
    ),
    "outliers": _m("fraction of the points that are five deviations off", good="below 0.05"),
    "off_plane": _m(
        "largest root mean square distance of a curve from its sampling plane, in noises",
        good="below 2",
    ),
    "unlike": _m("largest ratio of the spacings of two curves' points", good="below 5"),
    "scatter": _m(
        "how much more one curve scatters across its plane than the others, in standard deviations",
        good="below 3.3",
    ),
    "advice": _m("what to do about the doubts"),
}
