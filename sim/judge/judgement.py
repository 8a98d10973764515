"""What the judge's numbers come to: whether the tolerance is met, and what was not reached."""

from touchatlas.atlas.check.doubt import missed_words

# The numbers that say most of a run.
TEN = (
    "coverage",
    "accuracy_p95",
    "completeness_p95",
    "normal_error_deg_mean",
    "deviation_calibration",
    "watertight",
    "touches",
    "faces",
    "tracked_length",
    "seconds_total",
)


def is_met(numbers: dict) -> bool:
    """Whether a surface is as good as the tolerance asks; False without a surface.

    It is where 95 % of the surface is within the tolerance of the truth and 95 % of the truth
    within the tolerance of the surface: false surface fails the one, holes fail the other.

    Parameters
    ----------
    numbers : dict
        Those of an evaluation.

    Examples
    --------
    >>> is_met({"accuracy_p95": 0.2, "completeness_p95": 0.4, "tolerance": 0.3})
    False
    """
    false, missing = numbers.get("accuracy_p95"), numbers.get("completeness_p95")
    if false is None or missing is None:
        return False
    return bool(max(false, missing) <= numbers["tolerance"])


def largest_errors(numbers: dict) -> list[str]:
    """Where errors of single places are more than the tolerance, in sentences; none where none are.

    Parameters
    ----------
    numbers : dict
        Those of an evaluation.

    Examples
    --------
    >>> largest_errors({"accuracy_max": 3.2, "accuracy_max_place": (1, 2, 3), "tolerance": 1})
    ['The largest error of the surface is 3.2 tolerances, at (1, 2, 3).']
    """
    found = []
    for kind, words in (
        ("accuracy", "The largest error of the surface is {} tolerances, at ({})."),
        ("completeness", "The truth is up to {} tolerances away from the surface, at ({})."),
    ):
        error, place = numbers.get(f"{kind}_max"), numbers.get(f"{kind}_max_place")
        if error is not None and place is not None and error > numbers["tolerance"]:
            found.append(words.format(f"{error / numbers['tolerance']:.1f}", written(place)))
    return found


def verdict(numbers: dict) -> str | None:
    """Whether the tolerance is met (``is_met``), and what is wrong all the same, in words; None
    without a surface.

    >>> found = {"tolerance": 0.1, "accuracy_p95": 0.05, "completeness_p95": 0.05}
    >>> found |= {"euler_characteristic": 2, "true_euler_characteristic": 0}
    >>> verdict(found).partition(":")[0]
    'The tolerance 0.1 is met, but with other holes than the object has'
    """
    false, missing = numbers.get("accuracy_p95"), numbers.get("completeness_p95")
    if false is None or missing is None:
        return None
    errors, holes = largest_errors(numbers), other_holes(numbers)
    wrong = ["not everywhere"] * bool(errors) + ["with other holes than the object has"] * bool(
        holes
    )
    met = "met" if is_met(numbers) else "not met"
    if is_met(numbers) and wrong:
        met = f"met, but {' and '.join(wrong)}"
    words = (
        f"The tolerance {numbers['tolerance']:.4g} is {met}: 95% of the surface is within "
        f"{false:.4g} of the truth, and 95% of the truth within {missing:.4g} of the surface."
    )
    return " ".join([*missed_features(numbers), words, *errors, *holes])


def missed_features(numbers: dict) -> list[str]:
    """How large a hole or a horn may have been missed, in a sentence; none if it is not known."""
    diameter, place = numbers.get("free_disc"), numbers.get("free_disc_place")
    return [missed_words(diameter, place)] if diameter and place else []


def other_holes(numbers: dict) -> list[str]:
    """That the surface has other handles, cavities or parts than the object, in a sentence."""
    found, true = numbers.get("euler_characteristic"), numbers.get("true_euler_characteristic")
    if found is None or true is None or found == true:
        return []
    return [
        f"Its Euler characteristic is {found}, that of the object {true}: a hole, a cavity or a "
        "part is missing or too many."
    ]


def written(place) -> str:
    """A place (3,) as text.

    >>> written((1.0, -2.0, 0.33333))
    '1, -2, 0.3333'
    """
    return ", ".join(f"{x:.4g}" for x in place)


def truth_warnings(numbers: dict) -> list[str]:
    """What of the truth is missing, in sentences; none where all of it was reached.

    Parameters
    ----------
    numbers : dict
        Those of an evaluation.
    """
    found = []
    parts, reached = numbers["components"], numbers["components_reached"]
    if parts is not None and parts > 1 and reached < parts:
        found.append(
            f"{parts - reached} of the {parts} separate parts of the object were not reached: what "
            "lies inside another cannot be touched, and no contour leads from one to another; "
            "--planner.search 20 looks for parts beside"
        )
    if hidden := numbers["hidden_area"] or 0.0:
        found.append(f"{hidden:.1%} of the true surface lies inside, where no touch can reach it")
    # Lengths are those of what can be reached.
    if (missing := 1.0 - numbers["coverage"] - hidden) > 0.005:
        found.append(f"{missing:.1%} of the true surface is farther than the tolerance")
    return found
