"""What each number of a run is, its unit, and what is good: for tables, and for the glossary."""

from typing import NamedTuple

# Stands for the object's own unit of length, where it is not known to be millimetres.
LENGTH = "length"


class Meaning(NamedTuple):
    """A number of evaluation.json or a column of steps.csv."""

    what: str
    unit: str
    good: str


def _m(what: str, unit: str = "–", good: str = "–") -> Meaning:
    return Meaning(what, unit, good)


_BELOW = "< tolerance"
NUMBERS: dict[str, Meaning] = {
    "coverage": _m("fraction of the true area within three tolerances of the surface", good="1"),
    "accuracy_mean": _m("distance from the surface to the truth: mean", LENGTH, _BELOW),
    "accuracy_rms": _m("the same: root mean square", LENGTH, _BELOW),
    "accuracy_p95": _m("the same: 95 % of the surface is nearer", LENGTH, _BELOW),
    "accuracy_max": _m("the same: largest", LENGTH, "few tolerances"),
    "completeness_mean": _m("distance from the truth to the surface: mean", LENGTH, _BELOW),
    "completeness_rms": _m("the same: root mean square", LENGTH, _BELOW),
    "completeness_p95": _m("the same: 95 % of the truth is nearer", LENGTH, _BELOW),
    "completeness_max": _m("the same: largest", LENGTH, "few tolerances"),
    "chamfer": _m("mean of accuracy_mean and completeness_mean", LENGTH, _BELOW),
    "hausdorff": _m("larger of accuracy_max and completeness_max", LENGTH, "few tolerances"),
    "f_score": _m(
        "harmonic mean of the fractions of both surfaces within one tolerance of the other",
        good="1",
    ),
    "normal_error_deg_mean": _m(
        "angle between the true normal and that of the surface where the truth is covered: mean; "
        "null where nothing is",
        "degree",
        "below 1",
    ),
    "normal_error_deg_p95": _m("the same: 95 % is less", "degree", "few"),
    "deviation_calibration": _m(
        "fraction of the known surface whose error is within 1.96 predicted deviations; what was "
        "not reached counts in coverage alone",
        good="0.95",
    ),
    "watertight": _m(
        "whether each edge of the mesh has two triangles, wound alike", good="True if closed"
    ),
    "closed_holes": _m(
        "small holes of the surface that were closed across without a sample", good="0"
    ),
    "stray_pieces": _m("small pieces beside the surface that were left out", good="0"),
    "euler_characteristic": _m("V - E + F of the triangle mesh", good="the true one"),
    "true_euler_characteristic": _m("the same of the object; null where it is open"),
    "components": _m("separate parts of the object"),
    "components_reached": _m("parts of which something is within three tolerances", good="all"),
    "hidden_area": _m(
        "fraction of the true area in parts that lie inside others, where no touch reaches",
        good="0",
    ),
    "tolerance": _m("how well the surface was wanted", LENGTH),
    "diagonal": _m("of the object's bounding box", LENGTH),
    "met": _m(
        "whether 95 % of the surface is within the tolerance of the truth, and 95 % of the truth "
        "within it of the surface",
        good="True",
    ),
    "warnings": _m("what of the truth was not reached, in sentences", good="none"),
    "unit": _m("of all lengths; mesh files name none"),
    "total_curvature_over_2pi": _m(
        "integral of the surface's Gaussian curvature over 2 pi: its Euler characteristic if it is "
        "smooth and closed, 0 on a polyhedron; needs no truth",
        good="the true one",
    ),
    "ended": _m("why the exploration ended", good="known to the tolerance"),
    "predicted_coverage": _m(
        "expected fraction of the surface within the tolerance, without the truth", good="near 1"
    ),
    "open_places": _m("places that are not known to the tolerance", "length", good="few"),
    "unreachable_places": _m(
        "places where the pin would have passed through what was known", "length", good="none"
    ),
    "doubts": _m("what speaks against the surface, where, and what to do", good="none"),
    "noise_std": _m("standard deviation of each coordinate of each sample", LENGTH),
    "touches": _m("visits of the probe, also those without contact", good="few"),
    "touches_without_contact": _m("visits that met nothing", good="0"),
    "contours": _m("tracked curves", good="few"),
    "points": _m("samples in the atlas"),
    "patches": _m("patches at the end", good="few"),
    "parameters": _m("coefficients over all patches", good="few"),
    "patch_euler_characteristic": _m("V - E + F of the patch graph", good="the true one"),
    "tracked_length": _m("path of the probe in contact", LENGTH, "short"),
    "travel_length": _m("path of the probe in the air", LENGTH, "short"),
    "residual_patches": _m("patches that have a residual", good="0 if smooth"),
    "seconds_plan": _m("planning of all touches", "s"),
    "seconds_fit": _m("learning of all touches", "s"),
    "seconds_sim": _m("simulated probe", "s"),
    "seconds_start": _m("reading and sampling of the object", "s"),
    "seconds_repeat": _m("touches of the journal, learned again by resume", "s"),
    "seconds_record": _m("journal, steps.csv, true progress", "s"),
    "seconds_finish": _m("simplifying and residuals at the end", "s"),
    "seconds_surface": _m("extraction of the triangles", "s"),
    "seconds_evaluate": _m("comparison with the truth", "s"),
    "seconds_files": _m("atlas, surface and pictures written", "s"),
    "seconds_total": _m("all of these, and what little lies between", "s"),
}
COLUMNS: dict[str, Meaning] = {
    "touch": _m("number of the plan, from 0"),
    "reason": _m("why the place was chosen"),
    "x": _m("contact, as measured", LENGTH),
    "y": _m("the same", LENGTH),
    "z": _m("the same", LENGTH),
    "contours": _m("tracked curves of this touch", good="3"),
    "tracked_length": _m("path in contact, up to and with this touch", LENGTH, "short"),
    "travel_length": _m("path in the air, up to and with this touch", LENGTH, "short"),
    "patches": _m("patches after this touch"),
    "parameters": _m("coefficients after this touch"),
    "outlines_closed": _m(
        "fraction of the patches' outlines that other patches cover; of what is known, not of the "
        "object",
        good="1 at the end",
    ),
    "predicted_deviation": _m(
        "root mean square of the patches' deviation half-way to the rim", LENGTH, _BELOW
    ),
    "coverage": _m(
        "fraction of true points within three tolerances of the patches, also where the surface "
        "is not drawn because it is not trusted",
        good="1",
    ),
    "completeness_mean": _m("mean error of these points", LENGTH, _BELOW),
    "seconds_plan": _m("planning of this touch", "s"),
    "seconds_fit": _m("learning of this touch", "s"),
    "seconds_sim": _m("simulated probe", "s"),
    "predicted_coverage": _m(
        "expected fraction of the surface within the tolerance, when the touch was planned",
        good="near 1",
    ),
}
