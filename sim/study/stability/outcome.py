"""What became of a case, by numbers: good, flagged, refused, wrong or crashed."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.sim.study.stability.case import Case
from touchatlas.sim.study.stability.methods import Answer

# An error of so many noises is good whatever was predicted.
_NOISES = 3.0
# A predicted deviation above this fraction of the core radius tells nothing: a slope of three
# degrees.
_VAGUE = 0.05
# Rounding of exact contacts over the reach: the fits take noise to be no less.
_ROUNDING = 1e-6


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
        Root mean square distance of the true surface from the found one over the core, in noises;
        NaN without an answer.
    ratios : tuple of float
        Errors over predicted deviations: of the heights, the normal and the curvatures; NaN
        without prediction.
    held : float
        Fraction of the true points in the core that lie within 1.96 deviations.
    claim : float
        Core over reach.
    doubts : tuple of str
    words : str
        Of the refusal or the exception.
    """

    outcome: Outcome
    error: float = np.nan
    ratios: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    held: float = np.nan
    claim: float = np.nan
    doubts: tuple[str, ...] = ()
    words: str = ""


def verdict(method: Callable[[Case], Answer], case: Case) -> Verdict:
    """Run a method on a case and judge it.

    A warning of numpy counts as a crash, as every exception that is not a ValueError of ours.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            answer = method(case)
            return judge(answer, case)
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        return Verdict(Outcome.REFUSED if is_refusal(error) else Outcome.CRASHED, words=words)


def is_refusal(error: Exception) -> bool:
    """Whether the exception is a sentence of ours: a ValueError of a line of touchatlas."""
    if not isinstance(error, ValueError) or isinstance(error, np.linalg.LinAlgError):
        return False
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return trace is not None and trace.tb_frame.f_globals["__name__"].startswith("touchatlas.")


def judge(answer: Answer, case: Case) -> Verdict:
    """The law of the outcomes.

    Three errors are compared, all as lengths at the core radius c: the root mean square distance
    of the true surface from the found one within c of its origin; c times the angle of the
    normals; c^2/2 times the root mean square error of the two curvatures. Each must be within
    1.96 predicted standard deviations of the same quantity, or within 3 noises. A case of which
    all three are is good, but for one that is held only by a deviation of more than a twentieth of
    c: its own deviation flags it. Any other is flagged where the answer's diagnosis names a doubt,
    and wrong where it does not. Numbers that are not finite are wrong, whatever is said of them.
    """
    points = case.truth.around(answer.origin, answer.core)
    distance = answer.distance(points)
    shape, core = case.truth.at(answer.origin), answer.core
    angle = np.arctan2(
        np.linalg.norm(np.cross(shape.normal, answer.shape.normal)),
        shape.normal @ answer.shape.normal,
    )
    bends = [answer.shape.k1 - shape.k1, answer.shape.k2 - shape.k2]
    errors = np.array([_rms(distance), core * angle, 0.5 * core**2 * _rms(bends)])
    predicted, held = _predicted(answer, points, distance)
    unit = max(case.noise_std, _ROUNDING * case.reach)
    far = errors > _NOISES * unit
    held_by = far & (errors <= SURE * np.nan_to_num(predicted))
    vague = bool((held_by & (predicted > _VAGUE * core)).any())
    finite = np.isfinite(errors).all() and not np.isinf(predicted).any()
    if not finite or (far & ~held_by).any():
        outcome = Outcome.FLAGGED if answer.doubts and finite else Outcome.WRONG
    else:
        outcome = Outcome.FLAGGED if vague else Outcome.GOOD
    ratios = errors / predicted
    return Verdict(
        *(outcome, float(errors[0] / unit), tuple(ratios.tolist()), held),
        *(float(core / case.reach), answer.doubts),
    )


def _predicted(answer: Answer, points, distance):
    """Deviations of the three errors, and the fraction of the points within 1.96 of theirs."""
    if answer.deviation is None:
        return np.full(3, np.nan), np.nan
    deviation, core = answer.deviation(points), answer.core
    held = float(np.mean(np.abs(distance) <= SURE * deviation))
    known = [_rms(deviation), core * answer.normal_std, 0.5 * core**2 * answer.curvature_std]
    return np.array(known), held


def _rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
