"""Why and where arms of a plan end."""

import numpy as np

from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import ContourEnd
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.hybrid_control import ControlState
from touchatlas.planner.tracking.options import TrackingOptions


class ArmEnds:
    """Ends of arms side by side, whose planes have the normals ``w`` (m, 3).

    Parameters
    ----------
    plan : ProbePlan
    options : TrackingOptions
    w : (m, 3) float
    reach : float, length
        After which an arm is as long as it shall be.
    patience : float, s
        The time at which an arm that has not ended cannot be reached.
    """

    def __init__(
        self, plan: ProbePlan, options: TrackingOptions, w, reach: float, patience: float
    ) -> None:
        self._plan, self._options, self._w = plan, options, w
        self._reach, self._patience = reach, patience
        self._ends: list[ContourEnd | None] = [None] * len(w)
        self._losses, self._lost = np.zeros(len(w), int), np.zeros(len(w), bool)
        self._first, self._known = np.zeros_like(w), KnownSince(plan, len(w))

    @property
    def active(self) -> np.ndarray:
        """(m,) arms that have not ended."""
        return np.array([end is None for end in self._ends])

    def found(self) -> list[tuple[ContourEnd, int]]:
        """The end of each arm that has one, and how often it lost its contact."""
        ends = zip(self._ends, self._losses, strict=True)
        return [(end, int(losses)) for end, losses in ends if end is not None]

    def see(self, time: float, state: ControlState, off, contacts, over) -> None:
        """Note what ends at a reading: ``off`` (m, 3) is each tip's way from its start,
        ``contacts`` (m, 3) where it touches, and ``over`` (m,) whether its force is too large."""
        plan, active = self._plan, self.active
        now = state.sought > 0.0
        self._losses += now & ~self._lost & active
        self._lost = now
        turned, away = self._turned(state), np.sqrt((off**2).sum(axis=1))
        back = (state.travelled > 4.0 * plan.step) & (away < 0.5 * plan.step)
        reasons = (
            (over, ContourEnd.OVERLOAD),
            (state.sought > self._options.search, ContourEnd.LOST_CONTACT),
            (turned, ContourEnd.TURNED_AWAY),
            (back, ContourEnd.CLOSED_LOOP),
            (state.travelled >= self._reach, ContourEnd.LENGTH_REACHED),
            (self._known.long(contacts, state.travelled, active), ContourEnd.LENGTH_REACHED),
            (np.full(len(self._w), time > self._patience), ContourEnd.UNREACHABLE),
        )
        for holds, end in reasons:
            for arm in np.flatnonzero(holds & active):
                self._ends[arm] = self._ends[arm] or end

    def _turned(self, state: ControlState) -> np.ndarray:
        """(m,) arms in contact that have turned too far from where they began."""
        first, tangents = self._first, cross(self._w, state.normal)
        begins = (first == 0.0).all(axis=1) & (state.travelled >= 0.1 * self._plan.step)
        first[begins] = tangents[begins]
        turned = (tangents * first).sum(axis=1) < np.cos(self._plan.max_turn)
        return np.asarray(turned & (first != 0.0).any(axis=1) & ~self._lost)


class KnownSince:
    """Whether arms have been for more than the ``least`` steps where their plan says that the
    surface is known; it is evaluated once a step."""

    def __init__(self, plan: ProbePlan, count: int, least: int = 4) -> None:
        self._until, self._step, self._least = plan.until, plan.step, least
        self._next, self._steps = np.full(count, plan.step), np.zeros(count, int)

    def long(self, points, travelled, active) -> np.ndarray:
        """(m,) of arms at points (m, 3)."""
        due = active & (travelled >= self._next)
        if self._until is not None and due.any():
            self._next[due] += self._step
            far = travelled[due] > (self._least + 0.5) * self._step
            known = np.asarray(self._until(points[due])) & far
            self._steps[due] = np.where(known, self._steps[due] + 1, 0)
        return np.asarray(self._steps > self._least)
