"""What became of a case, of one patch or of a whole surface: one law for both."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np


class Outcome(Enum):
    """What became of a case."""

    GOOD = "good"
    FLAGGED = "flagged"
    REFUSED = "refused"
    WRONG = "wrong"
    CRASHED = "crashed"


@dataclass(frozen=True)
class Verdict:
    """The outcome of one method on one case.

    Parameters
    ----------
    outcome : Outcome
    error : float
        Of one patch: root mean square distance of the true surface from the found one over the
        core, in noises. Of a whole surface: its largest distance from the truth, in tolerances. NaN
        without an answer.
    ratios : tuple of float
        Errors over predicted deviations: of the heights, the normal and the curvatures; NaN
        without prediction.
    held : float
        Fraction of the points that lie within 1.96 deviations.
    claim : float
        Core over reach; or the fraction of the truth within three tolerances of the surface, where
        parts of the body that were not found do not count.
    doubts : tuple of str
    words : str
        Of the refusal or the exception; or how an exploration ended.
    touches : int
    """

    outcome: Outcome
    error: float = np.nan
    ratios: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    held: float = np.nan
    claim: float = np.nan
    doubts: tuple[str, ...] = ()
    words: str = ""
    touches: int = 0


def outcome_of(right: bool, doubts, finite: bool = True) -> Outcome:
    """*Good* is what is right, *flagged* what is not right but doubted, *wrong* all else, and
    whatever has numbers that are not finite."""
    if right and finite:
        return Outcome.GOOD
    return Outcome.FLAGGED if doubts and finite else Outcome.WRONG


def attempted(call: Callable[[], Verdict]) -> Verdict:
    """The verdict of a call, or of its exception.

    A sentence of ours is a refusal. Any other exception is a crash, and so is a warning of numpy.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return call()
    except Exception as error:
        outcome = Outcome.REFUSED if is_refusal(error) else Outcome.CRASHED
        return Verdict(outcome, words=f"{type(error).__name__}: {error}")


def is_refusal(error: Exception) -> bool:
    """Whether the exception is a sentence of ours: a ValueError of a line of touchatlas."""
    if not isinstance(error, ValueError) or isinstance(error, np.linalg.LinAlgError):
        return False
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and trace.tb_frame.f_globals["__name__"].startswith("touchatlas.")
