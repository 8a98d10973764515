"""What each number of a run is, its unit, and what is good: for tables, and for the glossary."""

from typing import NamedTuple

# The unit of lengths where no file names one; those of built-in objects are in millimetres.
LENGTH = "file's unit"


class Meaning(NamedTuple):
    """A number of evaluation.json or a column of steps.csv."""

    what: str
    unit: str = "–"
    good: str = "–"


_BELOW = "< tolerance"
NUMBERS: dict[str, Meaning] = {
    "coverage": Meaning("fraction of the true area within the tolerance of the surface", good="1"),
    "accuracy_mean": Meaning("distance from the surface to the truth: mean", LENGTH, _BELOW),
    "accuracy_rms": Meaning("the same: root mean square", LENGTH, _BELOW),
    "accuracy_p95": Meaning("the same: 95 % of the surface is nearer", LENGTH, _BELOW),
    "accuracy_max": Meaning("the same: largest", LENGTH, "few tolerances"),
    "accuracy_max_place": Meaning("the point of the surface with this distance", LENGTH),
    "completeness_mean": Meaning("distance from the truth to the surface: mean", LENGTH, _BELOW),
    "completeness_rms": Meaning("the same: root mean square", LENGTH, _BELOW),
    "completeness_p95": Meaning("the same: 95 % of the truth is nearer", LENGTH, _BELOW),
    "completeness_max": Meaning("the same: largest", LENGTH, "few tolerances"),
    "completeness_max_place": Meaning("the point of the truth with this distance", LENGTH),
    "chamfer": Meaning("mean of accuracy_mean and completeness_mean", LENGTH, _BELOW),
    "hausdorff": Meaning("larger of accuracy_max and completeness_max", LENGTH, "few tolerances"),
    "f_score": Meaning(
        "harmonic mean of the fractions of both surfaces within one tolerance of the other",
        good="1",
    ),
    "normal_error_deg_mean": Meaning(
        "angle between the true normal and that of the surface where the truth is covered: mean; "
        "null where nothing is",
        "degree",
        "below 1",
    ),
    "normal_error_deg_p95": Meaning("the same: 95 % is less", "degree", "few"),
    "deviation_calibration": Meaning(
        "fraction of the known surface whose error is within 1.96 predicted deviations; what was "
        "not reached counts in coverage alone",
        good="0.95",
    ),
    "watertight": Meaning(
        "whether each edge of the mesh has two triangles, wound alike", good="True if closed"
    ),
    "closed_holes": Meaning(
        "holes of the surface that were closed across without a sample", good="few"
    ),
    "stray_pieces": Meaning("small pieces beside the surface that were left out", good="0"),
    "euler_characteristic": Meaning("V - E + F of the triangle mesh", good="the true one"),
    "true_euler_characteristic": Meaning("the same of the object; null where it is open"),
    "components": Meaning("separate parts of the object"),
    "components_reached": Meaning(
        "parts of which something is within three tolerances", good="all"
    ),
    "hidden_area": Meaning(
        "fraction of the true area in parts that lie inside others, where no touch reaches",
        good="0",
    ),
    "tolerance": Meaning("how well the surface was wanted", LENGTH),
    "diagonal": Meaning("of the object's bounding box", LENGTH),
    "met": Meaning(
        "whether 95 % of the surface is within the tolerance of the truth, and 95 % of the truth "
        "within it of the surface; single errors may be larger, see hausdorff",
        good="True",
    ),
    "warnings": Meaning("what of the truth was not reached, in sentences", good="none"),
    "unit": Meaning("of all lengths: mm for built-in objects, the file's own for mesh files"),
    "total_curvature_over_2pi": Meaning(
        "integral of the surface's Gaussian curvature over 2 pi: its Euler characteristic if it is "
        "smooth and closed, 0 on a polyhedron; needs no truth",
        good="the true one",
    ),
    "ended": Meaning("why the exploration ended", good="known to the tolerance"),
    "predicted_coverage": Meaning(
        "expected fraction of the surface about the touches within the tolerance, without the "
        "truth; of the whole surface at the end of an exploration",
        good="near 1",
    ),
    "open_places": Meaning(
        "places that are open or less sure than 95 %; some may be left where nearly all is known",
        LENGTH,
        good="few",
    ),
    "unreachable_places": Meaning(
        "places where the pin would have passed through what was known", LENGTH, good="none"
    ),
    "free_disc": Meaning(
        "diameter of the largest disc without a sample: so large a hole or horn may be missed",
        LENGTH,
        good="small",
    ),
    "free_disc_place": Meaning("its centre", LENGTH),
    "feature": Meaning("smallest hole or horn that was asked for; 0 where none was", LENGTH),
    "region": Meaning("where the surface was wanted; empty where everywhere"),
    "faults": Meaning(
        "what is wrong with the touches, how large, and its chance if nothing is",
        good="none",
    ),
    "doubts": Meaning("what speaks against the surface, where, and what to do", good="none"),
    "noise_std": Meaning("standard deviation of each coordinate of each sample", LENGTH),
    "touches": Meaning("visits of the probe, also those without contact", good="few"),
    "touches_without_contact": Meaning("visits that met nothing", good="0"),
    "contours": Meaning("tracked curves", good="few"),
    "points": Meaning("samples in the atlas"),
    "faces": Meaning("lawful and free-form faces that the surface is drawn from", good="few"),
    "patches": Meaning("sextics and lawful pieces of all faces", good="few"),
    "tracked_length": Meaning("path of the probe in contact", LENGTH, "short"),
    "travel_length": Meaning("path of the probe in the air", LENGTH, "short"),
    "machine_seconds": Meaning("time of the simulated machine; null without one", "s"),
    "seconds_plan": Meaning("planning of all touches", "s"),
    "seconds_fit": Meaning("learning of all touches", "s"),
    "seconds_sim": Meaning("simulated probe", "s"),
    "seconds_start": Meaning("reading and sampling of the object", "s"),
    "seconds_repeat": Meaning("touches of the journal, learned again by resume", "s"),
    "seconds_record": Meaning("journal, steps.csv, true progress", "s"),
    "seconds_finish": Meaning("faces read once more at the end", "s"),
    "seconds_surface": Meaning("extraction of the triangles", "s"),
    "seconds_evaluate": Meaning("comparison with the truth", "s"),
    "seconds_files": Meaning("atlas, surface and pictures written", "s"),
    "seconds_total": Meaning("all of these, and what little lies between", "s"),
}
COLUMNS: dict[str, Meaning] = {
    "touch": Meaning("number of the plan, from 0"),
    "reason": Meaning("why the place was chosen"),
    "x": Meaning("contact, as measured", LENGTH),
    "y": Meaning("the same", LENGTH),
    "z": Meaning("the same", LENGTH),
    "contours": Meaning("tracked curves of this touch", good="3"),
    "tracked_length": Meaning("path in contact, up to and with this touch", LENGTH, "short"),
    "travel_length": Meaning("path in the air, up to and with this touch", LENGTH, "short"),
    "patches": Meaning("sextics and lawful pieces after this touch"),
    "predicted_deviation": Meaning(
        "predicted deviation at the points within three tolerances: root mean square; every fifth "
        "touch, as the next two",
        LENGTH,
        _BELOW,
    ),
    "coverage": Meaning("fraction of true points that the atlas knows to the tolerance", good="1"),
    "completeness_mean": Meaning("mean error of these points", LENGTH, _BELOW),
    "seconds_plan": Meaning("planning of this touch", "s"),
    "seconds_fit": Meaning("learning of this touch", "s"),
    "seconds_sim": Meaning("simulated probe", "s"),
    "predicted_coverage": Meaning(
        "expected fraction of the surface within the tolerance, when the touch was planned",
        good="near 1",
    ),
}
