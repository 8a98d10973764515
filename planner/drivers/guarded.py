"""GuardedTrigger: any controller with a touch probe as a ``Trigger`` whose every move stops at
contact."""

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np

from touchatlas.patch.checks import check_above, check_type
from touchatlas.patch.geometry.arrays import frozen_array
from touchatlas.planner.tracking.options import Tip, scaled


class MachineFault(RuntimeError):
    """A machine that needs somebody: an alarm, silence, a probe that stays closed."""


class OutOfReach(MachineFault):
    """A place beyond the limits of the machine; nothing has moved."""


@runtime_checkable
class Controller(Protocol):
    """What is asked of a controller with a touch probe. All places are in one frame and unit."""

    @property
    def bounds(self) -> np.ndarray:
        """(2, 3) lowest and highest coordinates that the machine reaches."""

    @property
    def period(self) -> float:
        """Seconds between two looks at the probe."""

    def closed(self) -> bool:
        """Whether the probe is in contact."""

    def position(self) -> np.ndarray:
        """(3,) where the machine is."""

    def toward(self, target: np.ndarray, feed: float) -> np.ndarray | None:
        """Go straight to a target and stop at contact: where it began, or None."""

    def away(self, target: np.ndarray, feed: float) -> bool:
        """Go straight to a target and stop where contact ends: whether it ended."""


# Units that controllers have.
MILLIMETRES = {"mm": 1.0, "in": 25.4}


def millimetres_of(unit: str) -> float:
    """Millimetres in a unit of a controller; ValueError for another one."""
    if unit not in MILLIMETRES:
        raise ValueError(f"unit is {unit!r}; it must be {' or '.join(MILLIMETRES)}")
    return MILLIMETRES[unit]


def check_overtravel(stop: float, feed: float, overtravel: float) -> None:
    """ValueError for a feed, length/s, from which a machine stops a length ``stop`` past a contact,
    more than the probe can be pushed."""
    if stop > overtravel:
        raise ValueError(
            f"from a feed of {feed:.4g}/s the machine stops {stop:.3g} past a contact, more than "
            f"the probe's overtravel of {overtravel:.4g}; give a slower feed"
        )


_LENGTHS = ("feed", "travel", "chatter", "release")


@dataclass(frozen=True)
class GuardOptions:
    """How a trigger probe is moved.

    Parameters
    ----------
    feed : float, length/s
        While a point is measured.
    travel : float, length/s
        On the way. The machine has to stop from it within the overtravel of the probe, since each
        way may meet something.
    chatter : float, length
        A contact this near to where a probe came free is its own bounce.
    release : float, length
        Within this way from a contact the probe has to come free.
    """

    feed: float = 2.0
    travel: float = 10.0
    chatter: float = 0.2
    release: float = 2.0

    def __post_init__(self) -> None:
        check_above(self, positive=_LENGTHS)

    def in_unit(self, millimetre: float) -> "GuardOptions":
        """The same in a unit of which a millimetre has so many."""
        return scaled(self, millimetre, _LENGTHS)


class GuardedTrigger:
    """A ``Trigger`` that never makes a move that contact would not stop.

    A controller's plain moves drive through a body. Here each way is a probing move: one that meets
    something ends there, and ``move`` says so. From contact it leaves by a move that ends where the
    probe comes free, so that a probe that is stuck is found out.

    Parameters
    ----------
    controller : Controller
    options : GuardOptions
    box : (2, 3) float, length, optional
        Lowest and highest coordinates that may be used, within those of the machine.
    """

    def __init__(
        self, controller: Controller, options: GuardOptions = GuardOptions(), box=None
    ) -> None:
        if not isinstance(controller, Controller):
            raise ValueError(
                f"controller is {type(controller).__name__}; give a Controller, such as "
                'Grbl.connect("tcp://ADDRESS:PORT") or LinuxCnc()'
            )
        check_type("options", options, GuardOptions)
        self._controller, self.options = controller, options
        bounds = np.array(controller.bounds, float)
        if box is not None:
            box = frozen_array(box, (2, 3), "box")
            if not (box[0] < box[1]).all():
                raise ValueError(f"box is {box.tolist()}; give its lowest corner, then its highest")
            bounds = np.array([np.maximum(bounds[0], box[0]), np.minimum(bounds[1], box[1])])
        if not np.isfinite(bounds).all():
            raise ValueError(
                "the controller has no soft limits in all axes; switch them on and home it, or "
                "give the box that the probe may use"
            )
        self._bounds = bounds
        # Direction of the move that met contact, (3,).
        self._came: np.ndarray | None = None
        self._has_moved = False

    @property
    def period(self) -> float:
        """Seconds between two looks at the probe."""
        return self._controller.period

    @property
    def lateness(self) -> tuple[float, float]:
        """Bias and standard deviation of a triggered place along the approach, length."""
        return lateness(self.options.feed, self.period)

    def reaches(self, points) -> bool:
        """Whether all points (k, 3) are within the limits."""
        points = np.asarray(points, float)
        return bool((points >= self._bounds[0]).all() and (points <= self._bounds[1]).all())

    def room(self, start, direction) -> float:
        """How far a straight way from a start (3,) in a unit direction (3,) stays within the
        limits, length; 0 where it begins beyond them."""
        if not self.reaches([start]):
            return 0.0
        start, direction = np.asarray(start, float), np.asarray(direction, float)
        ends = np.where(direction > 0.0, self._bounds[1], self._bounds[0]) - start
        moves = direction != 0.0
        return float((ends[moves] / direction[moves]).min())

    def position(self) -> np.ndarray:
        """(3,) where the machine is."""
        return self._controller.position()

    def move(self, way) -> bool:
        """Go along the straight lines through points (k, 3), and rest at the last one.

        Where contact stops it, it goes back by the way that it came, which was free, and rests
        where it began.

        Returns
        -------
        bool
            Whether it arrived; False where contact stopped it, or where a point is out of reach,
            before anything has moved.

        Raises
        ------
        MachineFault
            The probe stays closed, or the machine cannot go on.
        """
        way = frozen_array(way, (None, 3), "way")
        if not self.reaches(way):
            return False
        gone, self._has_moved = [self.position()], False
        for target in way:
            if not self._arrives(target):
                break
            gone.append(target)
        else:
            return True
        # A way that begins in contact and leads into the surface was not gone.
        if self._has_moved and not all(self._arrives(point) for point in reversed(gone)):
            raise MachineFault(
                "there is contact on the way back, which was free; something has moved"
            )
        return False

    def probe(self, target) -> np.ndarray | None:
        """Go straight to a target (3,) until the tip meets something.

        Returns
        -------
        (3,) float, length, world, or None
            Centre of the tip where contact began: where the controller saw it, less half of the
            way between two looks at the probe. None where it met nothing.

        Raises
        ------
        OutOfReach
            The target is beyond the limits; a shorter probing move would call the rest free.
        MachineFault
            The probe is in contact before it moves, or the machine cannot go on.
        """
        target = frozen_array(target, (3,), "target")
        if not self.reaches(target):
            low, high = (", ".join(f"{x:.6g}" for x in end) for end in self._bounds)
            raise OutOfReach(
                f"the target ({', '.join(f'{x:.6g}' for x in target)}) is beyond the limits "
                f"({low}) to ({high})"
            )
        controller = self._controller
        if controller.closed():
            raise MachineFault(
                "the probe is in contact before it is to measure; move it away first"
            )
        start = controller.position()
        hit = self._toward(start, target, self.options.feed)
        if hit is None or self._came is None:
            return None
        return hit - min(self.lateness[0], float(np.linalg.norm(hit - start))) * self._came

    def _toward(self, start, target, feed: float) -> np.ndarray | None:
        """Where a move from a start (3,) met contact, or None; the direction is kept."""
        self._has_moved = True
        hit = self._controller.toward(target, feed)
        if hit is not None:
            self._came = (target - start) / max(float(np.linalg.norm(target - start)), 1e-300)
        return hit

    def _arrives(self, target) -> bool:
        """Whether the probe came to a target (3,)."""
        # A probe that comes free may bounce: each try begins where it was free.
        for _ in range(3):
            if self._controller.closed() and not self._leaves(target):
                return False
            start = self._controller.position()
            hit = self._toward(start, target, self.options.travel)
            if hit is None:
                return True
            if float(np.linalg.norm(hit - start)) > self.options.chatter:
                return False
        return False

    def _leaves(self, target) -> bool:
        """Whether the probe came free on the way from contact to a target (3,); False where the way
        leads into the surface, and nothing has moved."""
        start = self._controller.position()
        way = target - start
        if self._came is None:
            raise MachineFault(
                "the probe is in contact, and it is not known from where it came; move it away by "
                "hand"
            )
        if way @ self._came >= 0.0:
            return False
        length = float(np.linalg.norm(way))
        # Until it comes free nothing stops the move, so it is short.
        near = start + way * min(1.0, self.options.release / length)
        self._has_moved = True
        if not self._controller.away(near, self.options.feed):
            raise MachineFault(
                f"the probe stays closed {min(length, self.options.release):.4g} from the contact; "
                "see its stylus and cable, and that its signal is not inverted"
            )
        return True


def lateness(feed: float, period: float) -> tuple[float, float]:
    """Bias and standard deviation of a triggered place, length, along the approach.

    A controller looks at its probe once a period, so it sees contact 0 to one period late, evenly
    spread: the mean of the way in that time is feed * period / 2, its deviation feed * period /
    sqrt(12).

    >>> lateness(12.0, 0.001)
    (0.006, 0.0034641016151377548)
    """
    return feed * period / 2.0, feed * period / float(np.sqrt(12.0))


def late(tip: Tip, feed: float, period: float) -> Tip:
    """A tip whose noise holds the spread of a trigger's lateness, too."""
    return replace(tip, noise_std=float(np.hypot(tip.noise_std, lateness(feed, period)[1])))
