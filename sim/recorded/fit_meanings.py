"""What each number of ``touchatlas fit`` is, its unit, and what is good."""

from touchatlas.sim.judge.number_meanings import LENGTH, Meaning

_PER_LENGTH = f"1 / {LENGTH}"

FIT_NUMBERS: dict[str, Meaning] = {
    "method": Meaning("how the patch was fitted, as --method says"),
    "frame": Meaning("origin of the patch, and axes: along k1, along k2, outward normal", LENGTH),
    "terms": Meaning("exponents of x, y, z of each term of the polynomial, in the frame"),
    "coefficients": Meaning(
        "of the terms, in z = sum c x^i y^j z^k", f"{LENGTH} to the power 1 - i - j - k"
    ),
    "coefficients_std": Meaning(
        "standard deviations of the coefficients, apart from each other",
        "as the coefficients",
        "small beside those that matter",
    ),
    "radius": Meaning("the patch holds within this distance of its origin", LENGTH),
    "k1": Meaning(
        "larger principal curvature at the origin, negative where it bulges", _PER_LENGTH
    ),
    "k2": Meaning("smaller principal curvature at the origin", _PER_LENGTH),
    "k1_std": Meaning(
        "standard deviation of k1: 95 % of errors are below 1.96 of it", _PER_LENGTH, "small"
    ),
    "k2_std": Meaning("the same of k2", _PER_LENGTH, "small"),
    "umbilic": Meaning("whether k1 and k2 differ by no more than noise explains"),
    "condition": Meaning(
        "condition number of the directions of the curves: 1.4 for three 60 degrees apart",
        good="below 10",
    ),
    "normal_std": Meaning(
        "root mean square angle between the true normal and the found one", "rad", "below 0.01"
    ),
    "residual_rms": Meaning(
        "root mean square distance of the points from the patch, bad contacts left out",
        LENGTH,
        "the noise",
    ),
    "noise_std": Meaning("noise of each coordinate of each point, that the fit took", LENGTH),
    "point_noise_std": Meaning(
        "the same, as --noise states or as estimated from the scatter of points along the curves",
        LENGTH,
    ),
    "displacement_std": Meaning(
        "standard deviation of each coordinate by which each curve may be displaced as a whole",
        LENGTH,
        "0",
    ),
    "count": Meaning("points that were fitted", good="100 or more"),
    "outliers": Meaning("points that were left out as bad contacts", good="0"),
    "warnings": Meaning("what is probably wrong with the file", good="none"),
    "flags": Meaning("what is to be known of the fit", good="few"),
    "assumed": Meaning("how the file was read"),
    "diagnosis": Meaning("tests of the patch against the curves, below"),
}
DIAGNOSIS_NUMBERS: dict[str, Meaning] = {
    "doubts": Meaning("names of the tests that fail", good="none"),
    "condition": Meaning("condition number of the directions of the curves", good="below 30"),
    "weakest_direction": Meaning("tangent direction in which the rim of the core is least certain"),
    "weakest_deviation": Meaning(
        "standard deviation of the patch there", LENGTH, "below 0.06 core radii"
    ),
    "leverage": Meaning(
        "its square over that of the noise; above 1 the place is extrapolated", good="below 1"
    ),
    "residual_ratio": Meaning(
        "root mean square of the residuals over their standard deviations", good="1"
    ),
    "serial": Meaning(
        "correlation of neighbouring residuals along the curves, in its standard deviations",
        good="below 2.3",
    ),
    "disagreement": Meaning(
        "how far the curves disagree on the surface where they cross, in standard deviations",
        good="below 3.3",
    ),
    "miss": Meaning(
        "largest distance of two curves where their planes cross, in standard deviations",
        good="below 4",
    ),
    "displaced": Meaning("names of the curves that are displaced from the others", good="none"),
    "sign_changes": Meaning(
        "fraction of the core where the Gaussian curvature has another sign than at the origin",
        good="0, unless the surface has such",
    ),
    "outliers": Meaning("fraction of the points that are five deviations off", good="below 0.05"),
    "off_plane": Meaning(
        "largest root mean square distance of a curve from its sampling plane, in noises",
        good="below 2",
    ),
    "unlike": Meaning("largest ratio of the spacings of two curves' points", good="below 5"),
    "scatter": Meaning(
        "how much more one curve scatters across its plane than the others, in standard deviations",
        good="below 3.3",
    ),
    "advice": Meaning("what to do about the doubts"),
}
