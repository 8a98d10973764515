"""Arms: what came of tracking one way in one plane, and the touch that arms make."""

from dataclasses import dataclass

import numpy as np

from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane
from touchatlas.planner.probe_plan import ProbePlan
from touchatlas.planner.tracking.options import Tip
from touchatlas.planner.tracking.time_series import CentreSamples, TimeSeries


@dataclass(frozen=True, eq=False)
class Arm:
    """What came of one arm.

    Parameters
    ----------
    series : TimeSeries
    samples : CentreSamples
        The first is that at the contact.
    end : ContourEnd
    losses : int
        How often the surface was lost, and sought.
    """

    series: TimeSeries
    samples: CentreSamples
    end: ContourEnd
    losses: int


def untracked(noise: float = 0.0) -> Arm:
    """An arm that could not be reached, or that was not tracked, beside one that was: with the
    noise of that one, length."""
    none = np.zeros((0, 3))
    series = TimeSeries(np.zeros(0), none, none, np.zeros(0))
    return Arm(series, CentreSamples(none, none, noise), ContourEnd.UNREACHABLE, 0)


def touch_of(
    plan: ProbePlan, origin, depth: float, status, arms: list[Arm], tip: Tip, travel, shared: float
) -> Touch:
    """The touch of a plan from its arms, forward before backward in each plane; the centre of the
    tip came from ``origin`` (3,) and went down to a depth. ``shared`` is the deviation of the error
    of all samples."""
    pairs = [(arms[k], arms[k + 1]) for k in range(0, len(arms) - 1, 2)]
    firsts = [arm.samples for arm in arms if len(arm.samples.centres)]
    if status is TouchStatus.TOUCHED and not firsts:
        status = TouchStatus.NO_CONTACT
    if status is not TouchStatus.TOUCHED:
        ends = np.stack([origin, origin - depth * plan.normal])
        way = ends if status is TouchStatus.NO_CONTACT else None
        place = plan.reference_point, plan.normal
        return Touch(plan.number, *place, (), status, 0.0, travel, way, systematic_std=shared)
    centre = np.mean([samples.centres[0] for samples in firsts], axis=0)
    normal = np.sum([samples.normals[0] for samples in firsts], axis=0)
    normal /= np.linalg.norm(normal)
    contours = tuple(
        _contour(centre, normal, plane, ahead, behind, tip)
        for plane, (ahead, behind) in zip(plan.planes, pairs, strict=True)
    )
    tracked = sum(float(arm.series.travelled.max(initial=0.0)) for arm in arms)
    length = float((origin - centre) @ plan.normal)
    beside = np.linalg.norm(origin - length * plan.normal - centre)
    way = np.stack([origin, origin - length * plan.normal]) if length > 5.0 * beside else None
    return Touch(
        plan.number,
        centre - tip.radius * normal,
        plan.normal,
        contours,
        TouchStatus.TOUCHED,
        tracked,
        travel,
        way,
        systematic_std=shared,
    )


def _contour(centre, normal, plane: SamplingPlane, ahead: Arm, behind: Arm, tip: Tip) -> Contour:
    """The contour of the two arms in a plane, with one sample at the contact."""
    back = CentreSamples(behind.samples.centres[1:][::-1], behind.samples.normals[1:][::-1], 0.0)
    if ahead.end is ContourEnd.CLOSED_LOOP:
        back = CentreSamples(np.zeros((0, 3)), np.zeros((0, 3)), 0.0)
    centres = np.vstack([back.centres, centre, ahead.samples.centres[1:]])
    normals = np.vstack([back.normals, normal, ahead.samples.normals[1:]])
    noise = max(ahead.samples.noise_std, behind.samples.noise_std)
    ends = behind.end, ahead.end
    points = centres - tip.radius * normals
    # All planes of a touch meet at its contact.
    own = SamplingPlane(centre - tip.radius * normal, plane.normal)
    return Contour(points, own, noise or tip.sample_std(1), ends, normals)
