"""RunOptions: the settings of one exploration, checked against its object."""

from dataclasses import dataclass
from numbers import Integral, Real
from statistics import NormalDist

import numpy as np

from touchatlas.atlas import AtlasOptions
from touchatlas.atlas.records.options import SCALE_NOISE
from touchatlas.patch.checks import check_whole
from touchatlas.planner import PlannerOptions
from touchatlas.sim.machine.fault_words import faults_of
from touchatlas.sim.machine.options import ProbeOptions
from touchatlas.sim.world.units import MILLIMETRES


@dataclass(frozen=True)
class RunOptions:
    """Settings of one exploration.

    Parameters
    ----------
    noise : float, length, optional
        Standard deviation of each coordinate of each point, in the file's unit (mm for built-in
        objects). By default 2e-4 of the diagonal of a mesh, or what touchatlas objects lists.
    tolerance : float, length, optional
        How well the surface is wanted, in the file's unit (mm for built-in objects). By default
        1e-3 of the diagonal of a mesh, or what touchatlas objects lists.
    max_touches : int, optional
        Stop after this many touches.
    max_length : float, length, optional
        Stop after this much tracked length, in the file's unit (mm for built-in objects).
    seed : int
        Seed of the probe's noise, and of objects that are random.
    unit : str, optional
        Of the lengths of a mesh whose file names none: nm, um, mm, cm, dm, m, in, ft or mil.
        Nothing is converted.
    fault : str
        What is wrong with the probe, to see what the atlas makes of it, as noise=3,moved=5:touch5,
        each once.
        noise=N: N times the stated noise. tip=L: all points lie that far outside, in the unit of
        the object. plane=A: planes are turned by A degrees. displaced=T: each curve is displaced by
        T tolerances. drift=T: by T tolerances a touch. moved=T:touchK: the object moves by T
        tolerances before touch K. outliers=P: that share of the points is off by up to 100
        deviations. lost=P: that share of the arms ends too early, as if contact were lost.
    probe : ProbeOptions
    planner : PlannerOptions
    atlas : AtlasOptions
    """

    noise: float | None = None
    tolerance: float | None = None
    max_touches: int | None = None
    max_length: float | None = None
    seed: int = 0
    unit: str | None = None
    fault: str = ""
    probe: ProbeOptions = ProbeOptions()
    planner: PlannerOptions = PlannerOptions()
    atlas: AtlasOptions = AtlasOptions()

    def __post_init__(self) -> None:
        check_number("noise", self.noise, or_zero=True)
        check_number("tolerance", self.tolerance)
        check_number("max-length", self.max_length)
        _check_count("max-touches", self.max_touches, 1)
        check_whole(self, "seed", 0, np.inf)
        check_unit(self.unit)
        faults_of(self.fault)
        for record, kind in (
            (self.probe, ProbeOptions),
            (self.planner, PlannerOptions),
            (self.atlas, AtlasOptions),
        ):
            if not isinstance(record, kind):
                raise ValueError(f"got {record!r}; {kind.__name__} are needed there")


def check_unit(unit: str | None) -> None:
    """ValueError for what is no unit of length."""
    if unit is not None and not (isinstance(unit, str) and unit in MILLIMETRES):
        raise ValueError(f"unit is {unit!r}; it must be one of {', '.join(MILLIMETRES)}")


def check_number(name: str, value: float | None, or_zero: bool = False) -> None:
    """ValueError for what is no finite number above zero, or zero where that is allowed."""
    if value is None:
        return
    number = isinstance(value, Real) and not isinstance(value, bool)
    # np.isfinite fails for integers of more than 64 bits.
    if not (number and (value > 0 or or_zero and value == 0) and value < np.inf):
        need = "0 or more" if or_zero else "more than 0"
        raise ValueError(f"{name} is {value!r}; it must be a finite number, {need}")


def _check_count(name: str, value: int | None, least: int) -> None:
    """ValueError for what is no whole number of ``least`` or more."""
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if value is not None and not (whole and value >= least):
        raise ValueError(f"{name} is {value!r}; it must be a whole number, {least} or more")


def check_tolerance(tolerance: float, diagonal: float) -> None:
    """ValueError for a tolerance that does not suit an object of this diagonal."""
    check_number("tolerance", tolerance)
    if tolerance > diagonal:
        raise ValueError(
            f"tolerance is {tolerance:g}, but the object is only {diagonal:.4g} across; "
            "give a smaller --tolerance, in the same unit"
        )
    # The rounding of points, with three digits of slack.
    if tolerance < 1e-12 * diagonal:
        raise ValueError(
            f"tolerance is {tolerance:g}, but an object {diagonal:.4g} across has coordinates that "
            f"are rounded; give a --tolerance of {1e-12 * diagonal:.2g} or more"
        )


def check_scale(noise: float, tolerance: float, diagonal: float) -> None:
    """ValueError for a noise and tolerance from which no surface can result; no file is written
    before."""
    check_tolerance(tolerance, diagonal)
    # The grid of a surface that is spread over more tolerances does not fit into memory.
    if noise > 1000 * tolerance:
        raise ValueError(
            f"noise is {noise:g}, more than 1000 times the tolerance {tolerance:g}; "
            "give a smaller --noise or a larger --tolerance"
        )


def check_end(options: RunOptions, noise: float, tolerance: float, diagonal: float) -> None:
    """ValueError for a run without a budget to a tolerance that most of the surface cannot meet.

    A sample is as good as its noise and what fits leave out, and a place is no surer than
    the planner's level ``surest`` of that.
    """
    if options.max_touches is not None or options.max_length is not None:
        return
    sample = np.hypot(noise, options.atlas.bias * fit_scale(noise, diagonal))
    least = options.planner.levels.surest * sample * NormalDist().inv_cdf(0.75)
    if tolerance < least:
        raise ValueError(
            f"tolerance is {tolerance:g}, but with samples that are good to {sample:.2g} less than "
            f"half of the surface can be known to it, so that the run would not end; "
            f"give a --tolerance of {least:.2g} or more, or a budget with --max-touches"
        )


def check_effort(options: PlannerOptions) -> None:
    """ValueError for a touch of so many samples that its fit would take seconds."""
    samples = 2 * options.curves * int(options.reach / options.step)
    # Of so many samples a fit takes a second.
    if samples > 10_000:
        raise ValueError(
            f"planner.curves, planner.reach, planner.step are {options.curves}, {options.reach}, "
            f"{options.step}, which makes {samples:.2g} samples a touch; give fewer, "
            f"10000 in all at most"
        )


def fit_scale(noise: float, diagonal: float) -> float:
    """Scale of the fits of an atlas, length: five deviations of the noise, or a small fraction of
    the object where there is no noise.

    It does not depend on the tolerance, so a looser one ends the same touches earlier.
    """
    return max(SCALE_NOISE * noise, 2e-4 * diagonal)
