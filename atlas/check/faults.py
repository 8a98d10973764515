"""Faults: what the touches show to be wrong with the probe or the setting, in words with place and
size, while an object is explored."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import bdtrc, fdtrc, pdtrc

from touchatlas.atlas.check.doubt import NOWHERE, Doubt, extent_of, some_apart
from touchatlas.atlas.samples.evidence import ProbeEvidence
from touchatlas.atlas.samples.predictive_law import LawPrior
from touchatlas.atlas.samples.shift import Shift
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.bad_contacts import OUTLIER
from touchatlas.patch.words import count_of

MOVED = "moved"
_NUMBERS = "size", "statistic", "expected", "chance"


@dataclass(frozen=True, eq=False)
class Fault:
    """Something wrong with the probe or the setting.

    Parameters
    ----------
    name : str
        Short name, always the same for the same kind.
    words : str
        What is wrong, by how much, and what to do: one sentence.
    size : float
        By how much: a factor, an angle in degrees, a length, or a share, as the words say.
    statistic, expected : float
        The number that was tested, and what it is in the mean where nothing is wrong.
    chance : float
        Chance of such a number where nothing is wrong.
    places : (k, 3) float, length, world
        Where, five places at most; none where it concerns the whole.
    """

    name: str
    words: str
    size: float
    statistic: float
    expected: float
    chance: float
    places: np.ndarray

    def as_dict(self) -> dict:
        """The fault, ready for JSON."""
        own = {name: float(getattr(self, name)) for name in _NUMBERS}
        return {"name": self.name, "words": self.words, **own, "places": self.places.tolist()}

    @property
    def doubt(self) -> Doubt:
        """The fault as something that speaks against an atlas."""
        return Doubt(self.name, self.words, self.places)


def faults(atlas: AtlasState) -> tuple[Fault, ...]:
    """What is wrong with the touches of an atlas; empty where nothing is.

    Each kind of fault is tested after each touch, and an exploration of a sound probe names one of
    a kind with the chance ``Levels.alpha``, however long it is.
    """
    found = (test(atlas) for test in TESTS)
    return tuple(fault for fault in found if fault is not None)


def larger_noise(atlas: AtlasState) -> Fault | None:
    """Noise that is larger than stated: see ``ProbeEvidence.noise_factor``."""
    evidence = atlas.evidence
    factor = evidence.noise_factor
    if factor == 1.0:
        return None
    words = (
        f"The noise is {factor:.2g} times the stated one, which is taken for it; state that, or "
        "see whether the probe is loose."
    )
    return _of_squares("larger noise", words, factor, evidence, "across")


def turned_planes(atlas: AtlasState) -> Fault | None:
    """Contours that leave their planes, as if these were turned."""
    evidence = atlas.evidence
    if not evidence.refutes("tilt"):
        return None
    # Noise that is larger than stated turns planes as well.
    factor = evidence.noise_factor
    square = evidence.sum("tilt") / factor**2
    if factor > 1.0 and not evidence.is_refuted(square, evidence.sum("tilt_freedom")):
        return None
    angles = np.array([touch.tilt_angle for touch in evidence.touches if touch.tilt_freedom])
    angle = float(np.rad2deg(np.sqrt(np.mean(angles**2))))
    words = (
        f"Contours leave their planes by {angle:.2g} degrees, and are taken in the planes of their "
        "samples; give the planes that the probe keeps to, or calibrate its orientation."
    )
    return _of_squares("turned planes", words, angle, evidence, "tilt")


def displaced_contours(atlas: AtlasState) -> Fault | None:
    """Curves of one touch that miss each other at the contact."""
    evidence = atlas.evidence
    spread = evidence.displacement
    if not spread:
        return None
    words = (
        f"The curves of a touch miss each other at its contact by {spread:.2g}, and are moved to "
        "where they meet most probably; see whether the probe or the object gives way."
    )
    return _of_squares("displaced contours", words, spread, evidence, "miss")


def bad_contacts(atlas: AtlasState) -> Fault | None:
    """Samples that no curve explains."""
    count, samples = len(atlas.bad_contacts), atlas.evidence.sum("samples")
    # Five deviations are passed once in 1.7 million.
    expected = 6e-7 * samples
    chance = float(pdtrc(count - 1, expected)) if count else 1.0
    if chance >= atlas.evidence.chance:
        return None
    share = count / samples
    words = (
        f"{share:.2%} of the samples are bad contacts, more than {OUTLIER:g} deviations off their "
        "curves, and are left out; see whether the probe slips or its signal has gaps."
    )
    places = some_apart(atlas.bad_contacts, extent_of(atlas.pool.points))
    return Fault("bad contacts", words, share, count, expected, chance, places)


def slipped_contacts(atlas: AtlasState) -> Fault | None:
    """Contact that is lost where the surface goes on: samples lie beyond."""
    ends = atlas.rims.ends
    count, is_open = len(ends), np.zeros(len(ends), bool)
    if not count:
        return None
    is_open[ends.open()] = True
    passed = int((~is_open).sum())
    level = atlas.levels.passed
    chance = float(bdtrc(passed - 1, count, level))
    if chance >= atlas.evidence.chance:
        return None
    words = (
        f"Contact was lost at {count_of(passed, 'end')} of {count} where the surface goes "
        "on; press harder, or track more slowly."
    )
    places = some_apart(ends.points[~is_open], extent_of(atlas.pool.points))
    return Fault("slipped contacts", words, passed / count, passed, level * count, chance, places)


def moved_object(atlas: AtlasState) -> Fault | None:
    """An object that moved between two touches: the next ones all lie beside the body of those
    before by one shift.

    The most probable shift of one to three touches in a row explains most of their squares: the
    body follows more. Over its degrees of freedom what it explains is compared with an F law,
    because deviations of the body are known as well as a Student t tells. The first three touches
    are small, and tell nothing, as those that cross no curve.
    """
    evidence, least = atlas.evidence, atlas.levels.explained
    touches = [one for k, one in enumerate(evidence.touches) if k < 3 or one.shift.square]
    best = None
    for last in range(4, len(touches) + 1):
        for first in range(max(last - 3, 3), last):
            some = [touch.shift for touch in touches[first:last]]
            limit = evidence.chance_after(last)
            # A shift explains no more than all squares.
            if _chance_of(sum(one.square for one in some), len(some)) >= limit:
                continue
            chance, explained, shift = _one_shift(some, least)
            if chance < limit and (best is None or chance < best[0]):
                best = chance, explained, shift, first
    if best is None or not np.linalg.norm(best[2]) > atlas.sample_std:
        return None
    chance, explained, shift, first = best
    # The object moved before the first touch of them that tells the shift.
    first += next(k for k, one in enumerate(touches[first:]) if _tells(one.shift, shift, least))
    size, number = float(np.linalg.norm(shift)), int(touches[first - 1].number)
    words = (
        f"The object has moved by {size:.2g} or more, ({', '.join(f'{x:.2g}' for x in shift)}), "
        f"after touch {number + 1}; fix it, and explore again."
    )
    return Fault(MOVED, words, size, explained, 3.0, chance, NOWHERE)


def _one_shift(some: list[Shift], least: float) -> tuple[float, float, np.ndarray]:
    """Chance that touches lie beside a body by one shift as well as they do, the squares that the
    shift explains, and the shift (3,), length; a chance of 1 where it explains too little."""
    every = sum(some[1:], some[0])
    shift = every.most_probable
    explained = every.square - every.left(shift)
    if not _tells(every, shift, least):
        return 1.0, explained, shift
    return _chance_of(explained, len(some)), explained, shift


def _tells(one: Shift, shift, least: float) -> bool:
    """Whether a shift (3,) explains more than a share of the squares of one or more touches."""
    return one.square - one.left(shift) > least * one.square


def _chance_of(square: float, touches: int) -> float:
    """Chance that one shift explains as much of the squares of so many touches."""
    return float(fdtrc(3.0, LawPrior.freedom * touches, square / 3.0))


def _of_squares(name: str, words: str, size: float, evidence: ProbeEvidence, of: str) -> Fault:
    """The fault that the squares of a name tell."""
    expected = evidence.sum(f"{of}_freedom")
    return Fault(name, words, size, evidence.sum(of), expected, evidence.chance_of(of), NOWHERE)


TESTS: tuple[Callable[[AtlasState], Fault | None], ...] = (
    moved_object,
    turned_planes,
    larger_noise,
    displaced_contours,
    slipped_contacts,
    bad_contacts,
)
