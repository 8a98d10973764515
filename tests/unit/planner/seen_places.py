"""Places and views as sources of targets get them."""

import numpy as np

from tests.truths import UP
from touchatlas.atlas import Atlas
from touchatlas.planner import PlannerOptions, Reason
from touchatlas.planner.attempts import Attempts, Pending, Target
from touchatlas.planner.places import Places
from touchatlas.planner.view import Phase, View

NOWHERE = np.zeros((0, 3))
EXTENT = 10.0
# Places along x, known to 1 to 5 hundredths; the last two are next to each other.
PLACES = np.array([[0.0, 0, 0], [2.0, 0, 0], [4.0, 0, 0], [6.0, 0, 0], [6.1, 0, 0]])
DEVIATION = np.array([0.01, 0.05, 0.03, 0.04, 0.04])
# Middles of the rim of a large opening, and of a hole of a fiftieth of the extent.
RIM = np.array([[9.0, 1, 0], [9.0, 4, 0], [3.0, 0, 0]])
SIZE = np.array([5.0, 5.0, 0.2])


def places(deviation=DEVIATION, rim=RIM, size=SIZE) -> Places:
    count, ends = len(deviation), len(rim)
    return Places(
        PLACES[:count],
        np.tile(UP, (count, 1)),
        np.asarray(deviation, float),
        np.zeros(count),
        np.ones(count),
        np.reshape(rim, (-1, 3)),
        np.tile(UP, (ends, 1)),
        np.ones((ends, 1)),
        np.full((ends, 1), np.inf),
        np.asarray(size, float),
        np.zeros(ends),
    )


class Sized(View):
    """A view of a body whose extent is given, not measured from samples."""

    extent = EXTENT


def view(touched=((0.0, 0.0, 0.0),), pending=(), in_vain=(), phase=Phase.GROW, **options) -> View:
    attempts = Attempts(np.zeros(3), UP)
    attempts.touched = [np.asarray(point, float) for point in touched]
    attempts.in_vain = [np.asarray(point, float) for point in in_vain]
    attempts.tried = list(attempts.in_vain)
    for number, point in enumerate(pending):
        attempts.pending[number] = Pending(None, Target(np.array(point), UP, Reason.REFINE))
    return Sized(Atlas(0.1), PlannerOptions(**options), attempts, phase)


def closed(deviation=DEVIATION) -> Places:
    return places(deviation, NOWHERE, np.zeros(0))
