"""Simulated probes with machines behind them: from a plan to a touch, and their state as text."""

import json
from dataclasses import replace
from typing import Protocol

import numpy as np

from touchatlas.atlas import Touch
from touchatlas.planner import ProbePlan
from touchatlas.planner.tracking.arms import Arm
from touchatlas.planner.tracking.options import Tip, TrackingOptions, TriggerOptions
from touchatlas.planner.tracking.touch_points import touch_points
from touchatlas.planner.tracking.track_plan import track_plan
from touchatlas.sim.machine.ball_trigger import BallTrigger
from touchatlas.sim.machine.beam_scanner import BeamScanner
from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.machine.options import ARM, SCANNING, Beam, ProbeOptions, Switch
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.probe import state_of


class SimulatedProbe(Protocol):
    """What a run needs of a probe."""

    def __call__(self, plan: ProbePlan) -> Touch:
        """The touch that answers a plan."""

    def state(self) -> str:
        """Place, clock and random numbers, as JSON."""

    def restore(self, state: str) -> None:
        """Go on from a state; ValueError if it is none."""


class MachineProbe:
    """A probe with a machine: subclasses carry out plans.

    Attributes
    ----------
    tip : Tip
        What is known of the tip. Its true radius and stiffness differ from it by errors with the
        deviations that it states, which are drawn first.
    machine : BeamScanner or BallTrigger
    """

    machine: BeamScanner | BallTrigger

    def __init__(self, tip: Tip, rng: np.random.Generator) -> None:
        self.tip, self._rng = tip, rng

    @property
    def seconds(self) -> float:
        """That the machine has taken, s."""
        return self.machine.seconds

    def state(self) -> str:
        """Place, clock and random numbers of the machine, as JSON; ``restore`` takes it."""
        machine = self.machine
        time = machine.time if isinstance(machine, BeamScanner) else 0.0
        held = {"position": machine.position().tolist(), "seconds": machine.seconds, "time": time}
        return json.dumps({**held, "random": self._rng.bit_generator.state})

    def restore(self, state: str) -> None:
        """Go on from a state, as if all touches before had been made; ValueError if it is none."""
        machine = self.machine
        with state_of(state) as known:
            machine.place(np.array(known["position"], float).reshape(3))
            machine.seconds = float(known["seconds"])
            if isinstance(machine, BeamScanner):
                machine.time = float(known["time"])
            self._rng.bit_generator.state = known["random"]


class ScanningProbe(MachineProbe):
    """A ball on a beam, whose force is controlled.

    Parameters
    ----------
    feet : Feet
    beam : Beam
        As it truly is.
    tip : Tip
        What is known of it.
    options : TrackingOptions
    home : (3,) float, length
        Where the tip is at first.
    rng : numpy.random.Generator
    normals : bool
        Whether touches hold contacts with normals, or centres of the ball.

    Attributes
    ----------
    arms : list of Arm
        Of the last touch.
    """

    machine: BeamScanner

    def __init__(
        self, feet: Feet, beam: Beam, tip: Tip, options: TrackingOptions, home, rng, normals=True
    ) -> None:
        super().__init__(tip, rng)
        self.options, self.arms, self._normals = options, list[Arm](), normals
        self.machine = BeamScanner(feet, beam, rng)
        self.machine.place(home)

    def __call__(self, plan: ProbePlan) -> Touch:
        """Approach along the planned normal, then track in every planned plane."""
        self.arms = []
        how = self.tip, self.options, self.arms, self._normals
        touch = track_plan(self.machine, plan, *how)
        # Arms begin where the last touch left the tip, whatever was read there.
        self.machine.place(self.machine.position())
        return touch


class TriggerProbe(MachineProbe):
    """A ball that stops at contact.

    Parameters
    ----------
    feet : Feet
    switch : Switch
        As it truly is.
    tip : Tip
        What is known of it.
    options : TriggerOptions
    home : (3,) float, length
        Where the tip is at first.
    rng : numpy.random.Generator
    """

    machine: BallTrigger

    def __init__(
        self, feet: Feet, switch: Switch, tip: Tip, options: TriggerOptions, home, rng
    ) -> None:
        super().__init__(tip, rng)
        self.options, self.machine = options, BallTrigger(feet, switch, rng)
        self.machine.place(home)

    def __call__(self, plan: ProbePlan) -> Touch:
        """Approach along the planned normal, then probe points in every planned plane."""
        return touch_points(self.machine, plan, self.tip, self.options)


# Of what holds the probe: relative deviation of the stiffness, deviation of the radius in mm, white
# noise of the force in N.
_CERTIFICATES = {ARM: (0.05, 0.002, 0.01), "measuring": (0.01, 0.0005, 0.003)}


def machine_probe(
    obj: ImplicitObject | MeshObject,
    options: ProbeOptions,
    noise: float,
    millimetre: float,
    rng: np.random.Generator,
) -> ScanningProbe | TriggerProbe:
    """The probe of an object that options describe.

    Parameters
    ----------
    obj : ImplicitObject or MeshObject
    options : ProbeOptions
    noise : float, length
        White noise of each coordinate of one reading, or one point.
    millimetre : float, length
    rng : numpy.random.Generator
    """
    feet, (top, up) = Feet(obj), obj.start()
    home = top + obj.diagonal * up
    loose, off, force = _CERTIFICATES[options.machine]
    stiff, wide = rng.normal(size=2)
    tip = Tip(stiffness_std=loose, radius_std=off, force_std=force).in_unit(millimetre)
    if options.radius is not None:
        tip = replace(tip, radius=options.radius)
    _check_ball(tip.radius, tip.radius_std, options.machine, obj)
    radius = tip.radius + tip.radius_std * wide
    if options.name == SCANNING:
        tip = replace(tip, noise_std=noise)
        beam = Beam(
            radius=radius,
            stiffness=tip.stiffness * (1.0 + loose * stiff),
            noise_std=noise,
            force_std=force,
            rapid=Beam.rapid * millimetre,
        )
        how = TrackingOptions().in_unit(millimetre)
        how = how if options.feed is None else replace(how, feed=options.feed)
        return ScanningProbe(feet, beam, tip, how, home, rng, options.normals)
    switch, tip = _switch(options, tip, radius, noise, millimetre)
    points = replace(TriggerOptions().in_unit(millimetre), points=options.points)
    return TriggerProbe(feet, switch, tip, points, home, rng)


def _check_ball(radius: float, std: float, machine: str, obj) -> None:
    """ValueError for a radius with a standard deviation, lengths, that no ball before an object
    has."""
    if radius < 5.0 * std:
        raise ValueError(
            f"--probe.radius is {radius:g}, but this machine knows a radius to {std:.2g}; give "
            f"{5.0 * std:.2g} or more"
            + (", or --probe.machine measuring" if machine == ARM else "")
        )
    if radius > obj.diagonal:
        raise ValueError(
            f"--probe.radius is {radius:g}, but {obj.name} has a diagonal of {obj.diagonal:.4g}; "
            "give a smaller ball"
        )


def _switch(options: ProbeOptions, tip: Tip, radius, noise, millimetre) -> tuple[Switch, Tip]:
    """A trigger as it truly is, and what is known of its tip."""
    switch = Switch().in_unit(millimetre)
    feed = switch.feed if options.feed is None else options.feed
    switch = replace(switch, radius=radius, noise_std=noise, feed=feed)
    # In the mean a switch opens late, by which the ball seems smaller.
    late = 0.5 * feed * switch.period + switch.travel
    if not late < tip.radius:
        raise ValueError(
            f"--probe.feed is {feed:g}, with which the switch opens {late:.3g} past the contact, "
            f"but the ball has a radius of {tip.radius:.3g}; give a slower feed"
        )
    spread = np.hypot(feed * switch.period / np.sqrt(12.0), switch.lobes / np.sqrt(2.0))
    tip = replace(
        tip,
        radius=tip.radius - late,
        noise_std=float(np.hypot(noise, np.hypot(spread, switch.step))),
        force_std=0.0,
    )
    return switch, tip
