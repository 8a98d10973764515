"""What is known of a tip, and how machines are moved: records with defaults in mm, N and s."""

from dataclasses import dataclass, replace

import numpy as np

from touchatlas.patch.checks import check_above, names_of


@dataclass(frozen=True)
class Tip:
    """What is known of a ball tip on its stylus, by certificate or by qualification on a ball.

    Parameters
    ----------
    radius : float, length
        Of the ball as it acts: the pre-travel of a trigger, in the mean, is taken off.
    radius_std : float, length
        Standard deviation of that: one common error of all samples.
    stiffness : float, N/length
        Force over bending, alike in all directions.
    stiffness_std : float
        Its standard deviation, over itself.
    noise_std : float, length
        White noise of each coordinate of one reading, or of one point of a trigger.
    force_std : float, N
        White noise of each component of the force in one reading.
    error_std : float, length
        Of each coordinate: what neighbouring readings have in common, so that their mean keeps it.
    """

    radius: float = 2.0
    radius_std: float = 0.0
    stiffness: float = 2.0
    stiffness_std: float = 0.0
    noise_std: float = 0.02
    force_std: float = 0.01
    error_std: float = 0.0

    def __post_init__(self) -> None:
        check_above(self, positive=("stiffness",))

    def sample_std(self, readings: int) -> float:
        """Standard deviation of each coordinate of a centre that some readings give.

        White parts shrink with the root of their number: the middle of a parabola through n of them
        has the deviation 1.5 s / sqrt(n). What they have in common stays.

        >>> round(Tip(noise_std=0.03, force_std=0.08, error_std=0.0).sample_std(25), 12)
        0.015
        """
        white = np.hypot(self.noise_std, self.force_std / self.stiffness)
        return float(np.hypot(white * min(1.0, 1.5 / np.sqrt(readings)), self.error_std))

    def in_unit(self, millimetre: float) -> "Tip":
        """The same tip in a unit of which a millimetre has so many."""
        return scaled(
            self, millimetre, ("radius", "radius_std", "noise_std", "error_std"), ("stiffness",)
        )


@dataclass(frozen=True)
class TrackingOptions:
    """How a scanner is moved.

    Parameters
    ----------
    force : float, N
        Set point of the force in contact.
    least : float, N
        Below it contact counts as lost.
    most : float, N
        Above it the tip leaves the surface, and the arm or approach ends.
    feed : float, length/s
        Along the surface.
    acceleration : float, length/s^2
        With which the feed grows.
    approach : float, length/s
        Toward the surface.
    gain, integral : float, 1/s and 1/s^2
        Of the proportional-integral control of the bending, force over stiffness.
    filter : float, Hz
        Low pass of the force by which the tip is controlled; samples are made of what was read.
    hold : float, 1/s
        Gain of the position across the plane.
    slowest : float
        Least fraction of the feed while the force is off its set point.
    search : float, length
        How far a lost surface is sought: against the last normal, and farther than the radius of
        the tip on a circle about the place of the last contact.
    search_speed : float, length/s
        How fast.
    lost_after : float, s
        How long the force has to be below ``least`` before the surface is sought.
    settle : float, s
        Rest after the contact, before the feed begins.
    window : float, s
        In which readings make one sample.
    retract : float, length
        How far the tip leaves the surface before it moves in air.
    patience : float
        An arm, an approach or a retreat that takes so many times the seconds of its length is
        stuck, and ends.
    """

    force: float = 0.4
    least: float = 0.05
    most: float = 1.5
    feed: float = 10.0
    acceleration: float = 50.0
    approach: float = 5.0
    gain: float = 16.0
    integral: float = 60.0
    filter: float = 30.0
    hold: float = 5.0
    slowest: float = 0.1
    search: float = 3.0
    search_speed: float = 5.0
    lost_after: float = 0.02
    settle: float = 0.2
    window: float = 0.16
    retract: float = 2.0
    patience: float = 4.0

    def __post_init__(self) -> None:
        check_above(self, positive=tuple(name for name in names_of(self) if name != "settle"))
        if not self.least < self.force < self.most:
            raise ValueError(
                f"least, force, most are {self.least}, {self.force}, {self.most}; each must be "
                "more than the one before"
            )

    def in_unit(self, millimetre: float) -> "TrackingOptions":
        """The same in a unit of which a millimetre has so many."""
        return scaled(
            self,
            millimetre,
            ("feed", "acceleration", "approach", "search", "search_speed", "retract"),
        )


@dataclass(frozen=True)
class TriggerOptions:
    """How a trigger probe is moved.

    Parameters
    ----------
    points : int
        Of each arm of a contour, besides the contact.
    turn : float, rad
        Angle on a circle about the point before, by which a point is looked for farther where it
        is not met. So far above the expected place a measurement begins where nothing says how the
        curve bends; nearer where the last points do.
    retract : float, length
        How far the tip leaves the surface after a point; and height above the expected place,
        besides what that may be off, at which a measurement begins.
    clearance : float, length
        Height above all that was touched at which ways between touches run where no lower way is
        known to be free.
    """

    points: int = 5
    turn: float = np.pi / 8.0
    retract: float = 2.0
    clearance: float = 20.0

    def __post_init__(self) -> None:
        check_above(self, positive=names_of(self))
        if not isinstance(self.points, int | np.integer):
            raise ValueError(f"points is {self.points!r}; it must be a whole number")
        if not self.turn <= 0.25 * np.pi:
            raise ValueError(f"turn is {self.turn!r}; it must be a quarter of pi or less")

    def in_unit(self, millimetre: float) -> "TriggerOptions":
        """The same in a unit of which a millimetre has so many."""
        return scaled(self, millimetre, ("retract", "clearance"))


def scaled(record, factor: float, lengths: tuple[str, ...], inverse: tuple[str, ...] = ()):
    """A record with its lengths times a factor, and what is over a length divided by it."""
    new = {name: getattr(record, name) * factor for name in lengths}
    return replace(record, **new, **{name: getattr(record, name) / factor for name in inverse})
