"""ProbeOptions: which probe touches a simulated object; and what simulated machines are truly."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.checks import check_above, check_whole
from touchatlas.patch.entry_points import PROBES, added
from touchatlas.planner.cost_model import CostModel
from touchatlas.planner.tracking.options import TrackingOptions, scaled

IDEAL, SCANNING, TRIGGER = "ideal", "scanning", "trigger"
ARM, MEASURING = "arm", "measuring"


@dataclass(frozen=True)
class ProbeOptions:
    """The probe of a simulated exploration.

    Parameters
    ----------
    name : str
        "ideal" gives points of the surface; "scanning" is a ball on a beam whose force is
        controlled, "trigger" a ball that stops at contact.
    machine : str
        What holds it: "arm", good to 0.02 mm, as the paper's, or "measuring", a machine good to
        0.002 mm.
    radius : float, length, optional
        Of the ball, in the file's unit (mm for built-in objects); 2 mm by default.
    feed : float, length/s, optional
        Along the surface, by default 10 mm/s, or of a trigger toward it, 5 mm/s.
    points : int
        Of each arm of a contour, for a trigger.
    normals : bool
        Whether a scanning probe knows the direction of its force. Without it touches hold centres
        of its ball.
    """

    name: str = IDEAL
    machine: str = ARM
    radius: float | None = None
    feed: float | None = None
    points: int = 5
    normals: bool = True

    def __post_init__(self) -> None:
        probes: tuple[str, ...] = (IDEAL, SCANNING, TRIGGER)
        # What other packages add is looked for where the name is none of ours.
        probes += () if self.name in probes else (*added(PROBES),)
        for name, value, known in (
            ("name", self.name, probes),
            ("machine", self.machine, (ARM, MEASURING)),
        ):
            if value not in known:
                raise ValueError(f"{name} is {value!r}; it must be one of {', '.join(known)}")
        check_above(self, ("radius", "feed"), ("radius", "feed"))
        # A contour of fewer than five points shows no normal.
        check_whole(self, "points", 2, 1000)
        if not isinstance(self.normals, bool | np.bool_):
            raise ValueError(f"normals is {self.normals!r}; it must be true or false")


def check_used(options: ProbeOptions) -> None:
    """ValueError for an option that its probe has not."""
    owners = {"points": TRIGGER, "normals": SCANNING}
    lacking = {
        IDEAL: ("radius", "feed", "points", "normals"),
        SCANNING: ("points",),
        TRIGGER: ("normals",),
    }
    for name in lacking.get(options.name, ()):
        value, usual = getattr(options, name), getattr(ProbeOptions(), name)
        if value != usual:
            with_it = owners.get(name, "scanning or trigger")
            raise ValueError(
                f"--probe.{name} is {value!r}, but the probe is {options.name}, which has none; "
                f"give --probe {with_it}, or leave it out"
            )


@dataclass(frozen=True)
class Beam:
    """A scanning probe as it truly is: lengths in mm by default, N, s.

    Parameters
    ----------
    radius : float, length
        Of the ball.
    stiffness : float, N/length
        Of the beam, alike in all directions.
    friction : float
        Coulomb's coefficient between ball and body.
    rate : float, Hz
        Of the readings.
    servo : float, Hz
        Bandwidth of first order with which the arm follows its commands.
    late : int
        Periods by which a reading comes late.
    noise_std : float, length
        White noise of each coordinate of the position in each reading.
    force_std : float, N
        White noise of each component of the force in each reading.
    rapid : float, length/s
        Speed in air.
    pause : float, s
        For each straight line in air, besides its length.
    """

    radius: float = 2.0
    stiffness: float = 2.0
    friction: float = 0.15
    rate: float = 250.0
    servo: float = 15.0
    late: int = 1
    noise_std: float = 0.02
    force_std: float = 0.01
    rapid: float = 50.0
    pause: float = 0.1

    def __post_init__(self) -> None:
        check_above(self, ("radius", "stiffness", "rate", "servo", "rapid"))


@dataclass(frozen=True)
class Switch:
    """A trigger probe as it truly is: lengths in mm by default, s.

    Parameters
    ----------
    radius : float, length
        Of the ball.
    travel : float, length
        By which the ball moves on after contact before the switch opens: the pre-travel.
    lobes : float, length
        Amplitude with which that depends on the direction: three lobes about the stylus, whose
        three legs stand on contacts (Estler and others, Practical aspects of touch-trigger probe
        error compensation, Precision Engineering 21, 1997).
    noise_std : float, length
        White noise along the approach.
    period : float, s
        Of the servo: the position is taken up to one period late.
    step : float, length
        To which positions are rounded.
    feed : float, length/s
        Toward a surface.
    rapid : float, length/s
        Speed in air.
    pause : float, s
        For each straight line, besides its length.
    """

    radius: float = 2.0
    travel: float = 0.01
    lobes: float = 0.004
    noise_std: float = 0.003
    period: float = 1e-3
    step: float = 1e-3
    feed: float = 5.0
    rapid: float = 50.0
    pause: float = 0.1

    def __post_init__(self) -> None:
        check_above(self, ("radius", "feed", "rapid"))

    def in_unit(self, millimetre: float) -> "Switch":
        """The same in a unit of which a millimetre has so many."""
        lengths = ("radius", "travel", "lobes", "noise_std", "step", "feed", "rapid")
        return scaled(self, millimetre, lengths)


def cost_of(options: ProbeOptions, millimetre: float) -> CostModel:
    """What the machine of a scanning probe takes for a touch. A model without speeds of the ideal
    probe, and of a trigger, whose touches take nearly as long everywhere."""
    if options.name != SCANNING:
        return CostModel()
    how = TrackingOptions().in_unit(millimetre)
    # Six arms, each of which leaves the surface, comes again and settles.
    arm = how.settle + how.retract / how.approach + Beam.pause
    return CostModel(
        Beam.rapid * millimetre, how.approach, options.feed or how.feed, touch=6.0 * arm
    )
