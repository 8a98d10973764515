"""Recordings of time, pose and force into touches, without the plans that a robot followed.

A robot that carries out a plan meets the surface, tracks an arm, lifts, and comes back to the same
place for the next arm. So a time in contact is an arm, and arms that begin at one place are one
touch; two that leave it in opposite directions in one plane are one contour.
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.checks import check_above, check_type, names_of
from touchatlas.patch.geometry.arrays import cross
from touchatlas.patch.geometry.contour import ContourEnd, SamplingPlane
from touchatlas.planner.drivers.recording import Recording
from touchatlas.planner.probe_plan import ProbePlan, Reason
from touchatlas.planner.tracking.arms import Arm, touch_of, untracked
from touchatlas.planner.tracking.options import Tip, TrackingOptions
from touchatlas.planner.tracking.time_series import CentreSamples, TimeSeries, samples_of, smoothed


@dataclass(frozen=True)
class ReplayOptions:
    """How a recording is read.

    Parameters
    ----------
    least : float, N
        Readings with less force are in the air.
    window : float, s
        In which readings make one sample; a shorter time in contact is none, and a shorter one in
        the air is a bounce.
    step : float, length, optional
        Between samples; by default what the tip travels in a window.
    step_turn : float, rad
        Turn of the normal beyond which there are samples between two.
    together : float, length, optional
        Arms that begin so near are of one touch; two steps by default.
    """

    least: float = TrackingOptions().least
    window: float = TrackingOptions().window
    step: float | None = None
    step_turn: float = np.pi / 12.0
    together: float | None = None

    def __post_init__(self) -> None:
        check_above(self, positive=names_of(self))


@dataclass(frozen=True, eq=False)
class _Track:
    """An arm, the normal (3,) of its plane, and where the tip began and in which direction."""

    arm: Arm
    plane: np.ndarray
    start: np.ndarray
    direction: np.ndarray


def touches_of(
    recording: Recording, tip: Tip, options: ReplayOptions = ReplayOptions(), first: int = 0
) -> list[Touch]:
    """The touches of a recording, numbered from ``first``.

    Contacts have the normals that the force shows, so they are learned where they are, beside their
    planes. A touch has no way: how the tip came there was not planned.

    Parameters
    ----------
    recording : Recording
    tip : Tip
        In the unit of the recording.
    options : ReplayOptions

    Raises
    ------
    ValueError
        In one sentence: an argument is of another type, or the tip was never in contact for a
        window of time, or in contact on a path that is in no plane.
    """
    check_type("recording", recording, Recording)
    check_type("tip", tip, Tip)
    check_type("options", options, ReplayOptions)
    size = np.sqrt((recording.forces**2).sum(axis=1))
    parts = times_in_contact(recording.times, size > options.least, options.window)
    tracks = [track for part in parts if (track := _track(recording, part, tip, options))]
    if not tracks:
        raise ValueError(
            f"the force was never above {options.least:g} N for {options.window:g} s while the tip "
            f"travelled; it is {np.median(size):.3g} N in the median: give another least force, or "
            "zero the sensor in air"
        )
    step = options.step or float(np.median([_spacing(t.arm.samples) for t in tracks]))
    near = options.together or 2.0 * step
    groups: list[list[_Track]] = []
    for track in tracks:
        if groups and np.linalg.norm(track.start - groups[-1][0].start) <= near:
            groups[-1].append(track)
        else:
            groups.append([track])
    return [_planar_touch(first + k, group, tip, step) for k, group in enumerate(groups)]


def times_in_contact(times, touching, window: float) -> list[slice]:
    """The parts of a recording in contact for a window of time or longer; shorter times in the air
    do not part them.

    >>> times = np.arange(12.0)
    >>> touching = np.array([0, 1, 1, 1, 0, 1, 1, 0, 0, 0, 1, 0], bool)
    >>> times_in_contact(times, touching, 2.5)
    [slice(1, 7, None)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], touching, [False]])))
    begins, ends = edges[::2].tolist(), edges[1::2].tolist()
    parts: list[list[int]] = []
    for begin, end in zip(begins, ends, strict=True):
        if parts and times[begin] - times[parts[-1][1] - 1] < window:
            parts[-1][1] = end
        else:
            parts.append([begin, end])
    return [slice(a, b) for a, b in parts if times[b - 1] - times[a] >= window]


def _track(recording: Recording, part: slice, tip: Tip, options: ReplayOptions) -> _Track | None:
    """The arm of a part in contact; None where the tip stood still."""
    times, forces = recording.times[part], recording.forces[part]
    period = float(np.median(np.diff(times)))
    count = min(2 * round(0.5 * options.window / period) + 1, len(times) - 1 + len(times) % 2)
    if count < 5:
        return None
    centres = smoothed(recording.positions[part] + forces / tip.stiffness, count)
    travelled = np.append(0.0, np.cumsum(np.sqrt((np.diff(centres, axis=0) ** 2).sum(axis=1))))
    step = options.step or float(travelled[-1]) * options.window / float(times[-1] - times[0])
    # A tip that only stands on the surface moves by its noise.
    reached = float(np.sqrt(((centres - centres[0]) ** 2).sum(axis=1)).max())
    if reached <= max(2.0 * step, 10.0 * tip.sample_std(count)):
        return None
    plane = _plane_of(centres, forces)
    series = TimeSeries(times, recording.positions[part], forces, travelled)
    samples = samples_of(series, plane, tip, options.window, options.least, step, options.step_turn)
    if len(samples.centres) < 2:
        return None
    direction = samples.centres[1] - samples.centres[0]
    direction /= np.linalg.norm(direction)
    end = _end(recording, part.stop, samples, options.window)
    return _Track(Arm(series, samples, end, 0), plane, samples.centres[0], direction)


def _plane_of(centres, forces) -> np.ndarray:
    """(3,) unit normal w of the plane of a path (n, 3), so that the tip travels along w x n.

    A straight path lies in many planes: that with the force is taken.
    """
    off = centres - centres.mean(axis=0)
    sizes, axes = np.linalg.svd(off, full_matrices=False)[1:]
    along, force = centres[-1] - centres[0], forces.mean(axis=0)
    bent = sizes[1] > 3.0 * sizes[2] and sizes[1] > 0.01 * sizes[0]
    w = axes[2] if bent else cross(force[None], along[None])[0]
    w = w / np.linalg.norm(w)
    steps, mean = np.diff(centres, axis=0), 0.5 * (forces[1:] + forces[:-1])
    forward = float((cross(np.tile(w, (len(mean), 1)), mean) * steps).sum())
    plane: np.ndarray = w if forward > 0.0 else -w
    return plane


def _end(recording: Recording, stop: int, samples: CentreSamples, window: float) -> ContourEnd:
    """Why an arm ended: the robot lifted its tip, or the surface ended below it.

    A tip that is lifted goes along the normal, one that has lost the surface goes on.
    """
    after = (recording.times >= recording.times[min(stop, len(recording.times) - 1)]) & (
        recording.times <= recording.times[stop - 1] + window
    )
    if not after.any():
        return ContourEnd.LENGTH_REACHED
    way = recording.positions[after][-1] - recording.positions[stop - 1]
    ahead = samples.centres[-1] - samples.centres[-2]
    ahead = ahead / max(float(np.linalg.norm(ahead)), 1e-300)
    lifted = float(way @ samples.normals[-1]) >= float(way @ ahead)
    return ContourEnd.LENGTH_REACHED if lifted else ContourEnd.LOST_CONTACT


def _spacing(samples: CentreSamples) -> float:
    """Median distance of successive samples."""
    return float(np.median(np.sqrt((np.diff(samples.centres, axis=0) ** 2).sum(axis=1))))


def _planar_touch(number: int, tracks: list[_Track], tip: Tip, step: float) -> Touch:
    """The touch of arms that begin at one place, each in a plane."""
    try:
        return _touch(number, tracks, tip, step)
    except ValueError as error:
        begin, end = (tracks[k].arm.series.times[k] for k in (0, -1))
        raise ValueError(
            f"the contact from {begin:.6g} to {end:.6g} s is no arm in a plane: "
            f"{str(error).partition(';')[0]}; lift the tip before it leaves the plane, or cut the "
            "recording there"
        ) from None


def _touch(number: int, tracks: list[_Track], tip: Tip, step: float) -> Touch:
    """The touch of arms that begin at one place."""
    arms: list[Arm] = []
    planes: list[SamplingPlane] = []
    rest = list(tracks)
    centre = np.mean([track.start for track in tracks], axis=0)
    # Half of the angle between three planes: arms are of one plane within it.
    alike = np.cos(np.radians(30.0))
    while rest:
        ahead = rest.pop(0)
        opposite = [
            k
            for k, other in enumerate(rest)
            if abs(other.plane @ ahead.plane) > alike and other.direction @ ahead.direction < -alike
        ]
        behind = rest.pop(opposite[0]).arm if opposite else None
        behind = behind or untracked(ahead.arm.samples.noise_std)
        arms += [ahead.arm, behind]
        planes.append(SamplingPlane(centre, ahead.plane))
    normal = np.sum([track.arm.samples.normals[0] for track in tracks], axis=0)
    normal /= np.linalg.norm(normal)
    reach = max(float(arm.series.travelled.max(initial=step)) for arm in arms)
    plan = ProbePlan(
        number, centre, normal, tuple(planes), max(reach, step), step, np.pi, Reason.START
    )
    force = np.concatenate([track.arm.series.forces for track in tracks])
    pressed = float(np.median(np.sqrt((force * force).sum(axis=1))))
    shared = float(np.hypot(tip.radius_std, pressed / tip.stiffness * tip.stiffness_std))
    return touch_of(plan, centre, 0.0, TouchStatus.TOUCHED, arms, tip, 0.0, shared)
