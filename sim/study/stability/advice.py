"""Acting on a diagnosis: do another plane, shorter curves or a new touch mend flagged cases?"""

from collections import Counter
from dataclasses import replace

import numpy as np

from touchatlas.patch import Diagnosis, Patch, diagnose, fit_patch
from touchatlas.sim.study.stability.case import Case
from touchatlas.sim.study.stability.families import FAMILIES
from touchatlas.sim.study.stability.methods import METHODS
from touchatlas.sim.study.stability.outcome import Outcome, verdict

# Doubts that one more curve in the weakest direction answers, and doubts about how the curves were
# recorded, which the same curves tracked again answer; all others ask for shorter curves.
_ANOTHER_PLANE = frozenset({"poor sections", "uncertain"})
_AGAIN = frozenset({"contradiction", "off plane", "unlike curves", "bad contacts", "small"})
# Most actions on one case. Doubled, arms become as short as a 256th.
_MOST_ACTIONS = 4


def act(case: Case, patch: Patch, diagnosis: Diagnosis, again: bool) -> Case:
    """The case after one action that its diagnosis advises.

    One more curve is tracked in the weakest direction, or the same curves are tracked again, or,
    where they were already (``again``) or another doubt stands alone, half as long.
    """
    assert case.probe is not None
    doubts = set(diagnosis.doubts)
    if doubts and doubts <= _ANOTHER_PLANE:
        more = case.probe(diagnosis.weakest_direction, case.reach)
        return replace(case, tracks=(*case.tracks, more))
    reach = case.reach if doubts & _AGAIN and not again else 0.5 * case.reach
    along = [np.cross(track.normal, patch.frame.normal) for track in case.tracks]
    tracks = tuple(case.probe(direction, reach) for direction in along)
    return replace(case, tracks=tracks, reach=reach)


def follow(case: Case) -> list[Outcome]:
    """Outcomes of a case at first and after each action, until it is good or actions run out."""
    found = [verdict(METHODS["map"], case).outcome]
    while found[-1] is Outcome.FLAGGED and len(found) <= _MOST_ACTIONS:
        contours = case.contours()
        patch = fit_patch(case.point, contours, case.outward).patch
        case = act(case, patch, diagnose(patch, contours), len(found) > 1)
        found.append(verdict(METHODS["map"], case).outcome)
    return found


def advice_study(families: tuple[str, ...], draws: int, seed: int = 0) -> dict[str, Counter]:
    """Of the flagged cases of each family, how many are what after acting on the diagnosis."""
    found: dict[str, Counter] = {}
    for name in families:
        ends: Counter = Counter()
        for place, severity in enumerate(FAMILIES[name].severities):
            for draw in range(draws):
                rng = np.random.default_rng([seed, *name.encode(), place, draw])
                case = FAMILIES[name].draw(severity, rng)
                if case.probe is not None:
                    outcomes = follow(case)
                    if outcomes[0] is Outcome.FLAGGED:
                        ends[outcomes[-1].value] += 1
        found[name] = ends
    return found
