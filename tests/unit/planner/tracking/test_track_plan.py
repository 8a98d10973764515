"""A machine that scans and does not follow its commands: a plan ends."""

from dataclasses import replace

import numpy as np
import pytest

from tests.truths import UP
from touchatlas.atlas import TouchStatus
from touchatlas.patch import SamplingPlane
from touchatlas.planner import ProbePlan, Reading, Reason, track_plan


class InAir:
    """A scanner that meets nothing, whose tip follows a share of the velocity."""

    def __init__(self, share: float) -> None:
        self.share, self.time, self.at = share, 0.0, 50.0 * UP
        self.velocity = np.zeros(3)

    def move(self, way) -> bool:
        self.at = np.asarray(way, float)[-1]
        return True

    def read(self) -> Reading:
        self.time += 0.05
        self.at = self.at + 0.05 * self.share * self.velocity
        return Reading(self.time, self.at, np.zeros(3))

    def command(self, velocity) -> None:
        self.velocity = np.asarray(velocity, float)


@pytest.mark.parametrize(
    ("share", "status"), [(1.0, TouchStatus.NO_CONTACT), (0.0, TouchStatus.UNREACHABLE)]
)
def test_an_approach_ends_in_the_air_and_where_the_machine_stands_still(share, status):
    """Only a way that was gone is known to be free."""
    plane = SamplingPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]))
    plan = ProbePlan(0, np.zeros(3), UP, (plane,), 4.0, 0.2, 2.0, Reason.REFINE)
    scanner = InAir(share)
    touch = track_plan(scanner, plan)
    assert touch.status is status and (touch.way is None) == (share == 0.0)
    assert not scanner.velocity.any()


@pytest.mark.parametrize(
    ("spoiled", "said"),
    [
        ({"force": np.full(3, np.nan)}, r"the force \[\[?nan, .* finite numbers: see sensor"),
        ({"position": np.array([0.0, np.inf, 0.0])}, r"reads the position .*inf.* finite numbers"),
        ({"time": -1.0}, r"reads a time of -1.0 s after .* by a clock that runs forward"),
        ({"time": np.nan}, r"reads a time of nan s after"),
    ],
)
def test_a_machine_that_is_blind_stands_still_and_says_why(spoiled, said):
    """Its force would be none, and it would press on."""
    plane = SamplingPlane(np.zeros(3), np.array([1.0, 0.0, 0.0]))
    plan = ProbePlan(0, np.zeros(3), UP, (plane,), 4.0, 0.2, 2.0, Reason.REFINE)
    scanner = InAir(1.0)
    sound = scanner.read
    scanner.read = lambda: replace(sound(), **(spoiled if scanner.time > 0.3 else {}))
    with pytest.raises(ValueError, match=said):
        track_plan(scanner, plan)
    assert scanner.time > 0.3 and not scanner.velocity.any()
