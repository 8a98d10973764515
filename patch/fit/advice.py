"""What to do about the doubts of a diagnosis, in sentences."""

ADVICE = {
    "poor sections": "The curves run in similar directions; track one more in another plane.",
    "uncertain": "Between the curves little is known; track one more in the weakest direction.",
    "small": "The patch covers little of what was tracked; take a reference point farther from the "
    "ends of the curves, or track them further to both sides.",
    "misfit": "The curves miss the patch by more than their noise; track shorter curves, or state "
    "a larger noise.",
    "waves": "The residuals run in waves: detail, an edge or drift that the patch does not follow; "
    "track shorter curves.",
    "contradiction": "The curves do not cross on one surface; track them again: the object may "
    "have moved, or one curve be of another frame or unit. The curves do not show which one.",
    "off plane": "A curve leaves its sampling plane; give the plane it was tracked in.",
    "unlike curves": "The samples of one curve lie much closer together than those of another, or "
    "scatter much less across its plane; see that all curves have one unit.",
    "bad contacts": "Many contacts are far off; track again, or elsewhere.",
    "noise overstated": "The curves lie much closer to the patch than their noise; state a smaller "
    "noise.",
}

# What is said of a contradiction where the curve is known, and the doubts that it explains.
_DISPLACED = (
    "Curve {} is displaced from the others; leave it out where three others are left, or track it "
    "again: the object may have moved, or the curve be of another frame."
)
_EXPLAINED = frozenset(
    {"contradiction", "uncertain", "misfit", "waves", "bad contacts", "noise overstated"}
)


def advice_on(doubts: tuple[str, ...], displaced: tuple[str, ...]) -> tuple[str, ...]:
    """What to do about doubts, a sentence each.

    Doubts that displaced curves explain get no advice: one more curve, or shorter ones, would not
    mend them.

    Parameters
    ----------
    doubts : tuple of str
        Keys of ADVICE.
    displaced : tuple of str
        Names of the curves that are displaced from the others.

    Examples
    --------
    >>> advice_on(("uncertain", "contradiction"), ("b",))[0][:36]
    'Curve b is displaced from the others'
    """
    explained = _EXPLAINED if displaced else frozenset()
    named = tuple(_DISPLACED.format(name) for name in displaced)
    return named + tuple(ADVICE[doubt] for doubt in doubts if doubt not in explained)
