"""Faults: what the touches show to be wrong with the probe or the setting, in words with place and
size, while an object is explored."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import bdtrc, pdtrc

from touchatlas.atlas.check.doubt import NOWHERE, Doubt, some_apart
from touchatlas.atlas.samples.evidence import ProbeEvidence
from touchatlas.atlas.samples.object_move import most_probable_move
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.fit.bad_contacts import OUTLIER
from touchatlas.patch.geometry.arrays import box_diagonal
from touchatlas.patch.words import count_of

MOVED, DRIFT = "moved", "drift"
_NUMBERS = "size", "statistic", "expected", "chance"


@dataclass(frozen=True, eq=False)
class Fault(Doubt):
    """Something wrong with the probe or the setting: a doubt with the numbers of a test.

    Parameters
    ----------
    size : float
        By how much: a factor, an angle in degrees, a length, or a share, as the words say.
    statistic, expected : float
        The number that was tested, and what it is in the mean where nothing is wrong.
    chance : float
        Chance of such a number where nothing is wrong.
    """

    size: float
    statistic: float
    expected: float
    chance: float

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
    places = some_apart(atlas.bad_contacts, box_diagonal(atlas.pool.points))
    return Fault("bad contacts", words, places, share, count, expected, chance)


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
    places = some_apart(ends.points[~is_open], box_diagonal(atlas.pool.points))
    return Fault("slipped contacts", words, places, passed / count, passed, level * count, chance)


def moved_object(atlas: AtlasState) -> Fault | None:
    """An object that moved between two touches or with every touch, so that contours miss each
    other by one shift where they cross: see ``most_probable_move``."""
    evidence, sure = atlas.evidence, atlas.levels.sure
    order = [touch.number for touch in evidence.touches]
    found = most_probable_move(evidence.crossings, order, sure)
    if found is None or found.chance >= evidence.chance:
        return None
    size = float(np.linalg.norm(found.shift))
    # Touches of a sound probe may differ by as much as samples err together.
    if size <= np.hypot(atlas.sample_std, atlas.systematic_std):
        return None
    shift = f"{size:.2g} or more, ({', '.join(f'{x:.2g}' for x in found.shift)})"
    if found.after is None:
        name, words = DRIFT, f"The object or the probe drifts by {shift}, from touch to touch"
    else:
        name, words = MOVED, f"The object has moved by {shift}, after touch {found.after + 1}"
    words += "; fix it, and explore again."
    places = some_apart(found.places, box_diagonal(atlas.pool.points))
    return Fault(name, words, places, size, found.explained, found.freedom, found.chance)


def _of_squares(name: str, words: str, size: float, evidence: ProbeEvidence, of: str) -> Fault:
    """The fault that the squares of a name tell."""
    expected = evidence.sum(f"{of}_freedom")
    return Fault(name, words, NOWHERE, size, evidence.sum(of), expected, evidence.chance_of(of))


TESTS: tuple[Callable[[AtlasState], Fault | None], ...] = (
    moved_object,
    turned_planes,
    larger_noise,
    displaced_contours,
    slipped_contacts,
    bad_contacts,
)
