"""What the judge's numbers come to: whether the tolerance is met, and what was not reached."""

# Coverage above which nothing is said of what was not reached. Doubled distance from one: half a
# percent more may be missing without a word.
_WHOLE = 0.995


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
    if hidden := numbers["hidden_area"]:
        found.append(f"{hidden:.1%} of the true surface lies inside, where no touch can reach it")
    if numbers["coverage"] < _WHOLE:
        found.append(f"{1.0 - numbers['coverage']:.1%} of the true surface was not reached")
    return found
