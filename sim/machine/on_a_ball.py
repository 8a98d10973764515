"""What simulated probes measure on a ball: the 25 points, or four scan lines at two forces."""

from dataclasses import replace

import numpy as np

from touchatlas.patch import SamplingPlane
from touchatlas.planner import ProbePlan, Reason
from touchatlas.planner.drivers.fitted_ball import pattern_1x25
from touchatlas.planner.drivers.recording import Recording
from touchatlas.sim.machine.options import ProbeOptions
from touchatlas.sim.machine.probes import ScanningProbe, TriggerProbe, machine_probe
from touchatlas.sim.world.implicit_fields import quadric_with_bumps
from touchatlas.sim.world.implicit_object import ImplicitObject


def probe_before_a_ball(options: ProbeOptions, radius: float, noise: float, rng):
    """The simulated probe of some options before a ball about 0; lengths in mm."""
    half = (radius,) * 3
    ball = ImplicitObject("ball", "", quadric_with_bumps(half), half, noise, 0.01 * radius)
    return machine_probe(ball, options, noise, 1.0, rng)


def measured_on_a_ball(probe: ScanningProbe | TriggerProbe, radius: float):
    """Points (25, 3) of a trigger, or the recording of a scanning probe, on a ball of a radius, mm,
    about 0."""
    if isinstance(probe, TriggerProbe):
        return _points(probe, radius)
    return _recording(probe, radius)


def _points(probe: TriggerProbe, radius: float) -> np.ndarray:
    """(25, 3) centres at the places of the pattern, ring by ring; ways go around the ball."""
    machine, centres = probe.machine, radius + probe.tip.radius
    found = []
    for u in pattern_1x25([0.0, 0.0, 1.0]):
        machine.move(_around(machine.position(), 1.2 * centres * u, 2.0 * centres))
        place = machine.probe(0.5 * centres * u)
        assert place is not None
        found.append(place)
    return np.array(found)


def _around(start, goal, radius: float) -> np.ndarray:
    """(4, 3) points of a way from outside of a ball about 0 to outside of it, by a sphere of a
    radius."""
    a, b = (np.asarray(point) / np.linalg.norm(point) for point in (start, goal))
    middle = a + b
    if np.linalg.norm(middle) < 0.1:
        middle = np.cross(a, np.eye(3)[np.abs(a).argmin()])
    middle = middle / np.linalg.norm(middle)
    return np.array([radius * a, radius * middle, radius * b, goal])


def _recording(probe: ScanningProbe, radius: float) -> Recording:
    """Readings along the equator, a circle above it, a half circle over the pole and one beside it,
    each at two forces."""
    # Lines beside the equator and the pole, 8 mm off for a ball of 25 mm.
    h, usual = 0.64 * radius, probe.options
    level = np.sqrt(radius**2 - h * h)
    z, y = np.eye(3)[2], np.eye(3)[1]
    lines = (
        (np.array([radius, 0.0, 0.0]), z, np.pi),
        (np.array([level, 0.0, h]), z, np.pi),
        (np.array([0.0, 0.0, radius]), y, 0.5 * np.pi),
        (np.array([0.0, h, level]), y, 0.5 * np.pi),
    )
    times, positions, forces, last = [], [], [], 0.0
    for force in (usual.force, 0.5 * usual.force):
        probe.options = replace(usual, force=force)
        for place, w, turn in lines:
            plane, reach = SamplingPlane(place, w), turn * (radius + probe.tip.radius)
            step = 0.05 * radius
            plan = ProbePlan(0, place, place / radius, (plane,), reach, step, np.pi, Reason.START)
            probe(replace(plan, way=lambda a, b, r: _around(a, b, 2.0 * (radius + r))))
            for arm in probe.arms:
                series = arm.series
                if len(series.times) < 2:
                    continue
                # A reading in air parts an arm from the next.
                began = last + 1.0 - series.times[0]
                times.append(np.append(series.times + began, series.times[-1] + began + 0.5))
                last = float(times[-1][-1])
                positions.append(np.vstack([series.positions, series.positions[-1] + place]))
                forces.append(np.vstack([series.forces, np.zeros(3)]))
    probe.options = usual
    return Recording(np.concatenate(times), np.vstack(positions), np.vstack(forces), "mm")
