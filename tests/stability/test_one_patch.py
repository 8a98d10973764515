"""What becomes of a patch in each family of difficulties, severity by severity.

A row has one letter for each severity, from easy to hard. The severities and their units are those
of the family. What is good, flagged or refused is defined by ``verdict``, with its tolerances.
"""

import numpy as np
import pytest

from touchatlas.sim.study.families import FAMILIES
from touchatlas.sim.study.one_patch import METHODS, verdict
from touchatlas.sim.study.outcome import Outcome

GIVEN = {Outcome.GOOD, Outcome.FLAGGED}
MEANING = {
    "G": {Outcome.GOOD},
    "F": {Outcome.FLAGGED},
    "R": {Outcome.REFUSED},
    "f": GIVEN,
    # Never silently wrong.
    "n": GIVEN | {Outcome.REFUSED},
    # Known to be silently wrong in one of the two cases, or in both.
    "w": GIVEN | {Outcome.REFUSED, Outcome.WRONG},
}
EXPECTED = {
    # Shapes.
    "umbilic": "GGGGGGGG",  # directions need not be known
    "parabolic": "GGGGGGGG",  # one curvature may vanish
    "plane": "GGGGGGGG",  # both curvatures may vanish
    "saddle": "GGGGGGGG",
    "monkey_saddle": "GGGGwnnn",  # the curves see a part of the cubic only
    "changing_sign": "GGGGGGGG",
    "unseen_cubic": "GGGGnnww",  # a cubic that no curve sees
    "torus": "GGGGGwnn",  # arms as long as the tube's radius are held
    "fold": "GGGGGnnn",  # a ball is followed to 80 degrees; then arms pass its equator
    "crease_distance": "GGnnnnnn",  # an edge at the rim does no harm
    "crease_angle": "GGGwwnnn",  # an edge of one degree is within the noise
    "corner": "GGnnnnnn",  # a corner at the rim does no harm
    "step": "GGwwFFFF",  # a step of one noise is noise, ten are seen
    "texture_height": "GGGGnFFF",  # waves of two noises are noise, ten are seen
    "texture_length": "GGwnFFFF",  # waves of two reaches are followed, of a quarter are seen
    "radius": "GGGGwnnn",  # touches that reach over more than one feature
    # Sampling.
    "exact": "GGGGnnnn",  # contacts without noise are not trusted between the curves
    "parallel_planes": "GGffRRRR",  # two degrees apart determine nothing
    "situation_b": "GGGGnnnR",  # the paper's: two curves in nearly one direction
    "grazing": "GGGGGGnn",  # planes may lean by 80 degrees
    "few_points": "GGGGGwwR",  # nine samples of a contour are enough
    "few_curves": "GGGGGGRR",  # three curves are enough
    "short_curve": "GnnnnRRR",  # a curve of three samples is refused
    "one_sided": "GGGGGGnn",  # one arm may be a tenth of the others
    "all_one_sided": "GGGGGGnn",  # the point may lie near the rim of what was touched
    "missing_point": "GGGGGGGG",  # curves may miss the point
    "scale": "GGGGGGGG",  # no unit of length is special
    "far_away": "GGGGGGGG",  # nor is the origin
    "repeated_points": "GGGGnnnn",  # two of five samples may repeat
    "still_curve": "GRRR",  # a curve without length is noise alone
    "other_unit": "GGGnnFFF",  # a hundredth is within the deviations, tenfold units are seen
    "other_frame": "GGGGnnFF",  # 0.3 degrees are within the deviations, ten are seen
    "wrong_plane": "GGGGGnFF",  # three degrees do no harm, twenty are seen
    # Noise.
    "noise": "nGGGGGGG",
    "stated_noise": "nGGGnnnn",  # the stated noise may be wrong by a tenth to one
    "bad_contacts": "GGGGnnFF",  # one in ten is left out, three are seen
    "bad_both_sides": "GGnnnnnn",  # one in twenty is left out
    "drift": "GGGGfFFf",  # a drift of two noises is tolerated, eight are seen
    "contradiction": "GGGwnnFF",  # a curve one noise off is good, thirty are seen
    "uneven_noise": "GGGwnnnn",  # four times the noise is weighed
}


@pytest.mark.parametrize("draw", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", FAMILIES)
def test_outcomes_of_a_family(name, draw):
    """A case of each severity; the sweep of docs/stability.md has 25."""
    family = FAMILIES[name]
    for place, (severity, letter) in enumerate(zip(family.severities, EXPECTED[name], strict=True)):
        rng = np.random.default_rng([0, *name.encode(), place, draw])
        found = verdict(METHODS["map"], family.draw(severity, rng))
        assert found.outcome in MEANING[letter], (family.title, severity, found)
        if found.outcome in GIVEN:
            assert np.isfinite((found.error, *found.ratios, found.held, found.claim)).all()


@pytest.mark.slow
@pytest.mark.parametrize("method", [m for m in METHODS if m != "map"])
@pytest.mark.parametrize("name", FAMILIES)
def test_other_methods_answer_or_refuse_the_easiest_and_the_hardest_case(name, method):
    family = FAMILIES[name]
    for severity in (family.severities[0], family.severities[-1]):
        case = family.draw(severity, np.random.default_rng(0))
        assert verdict(METHODS[method], case).outcome is not Outcome.CRASHED
