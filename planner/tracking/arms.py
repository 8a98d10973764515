"""Arms: what came of tracking one way in one plane, and the touch that arms make."""

from dataclasses import dataclass, replace

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
        # The ball has passed what is a radius below its centre.
        ends = np.stack([origin, origin - (depth + tip.radius) * plan.normal])
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
    contact = centre - tip.radius * normal
    length = float((origin - centre) @ plan.normal)
    aside = origin - contact
    beside = np.linalg.norm(aside - (aside @ plan.normal) * plan.normal)
    way = np.stack([origin, origin - length * plan.normal]) if length > 5.0 * beside else None
    return Touch(
        plan.number,
        contact,
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


def of_centres(touch: Touch, radius: float) -> Touch:
    """A touch of contacts with normals as that of the centres of a ball, each contour in the plane
    in which its centres lay."""
    if touch.status is not TouchStatus.TOUCHED:
        way = touch.way
        if way is not None:
            way = np.stack([way[0], way[1] + radius * touch.approach])
        return replace(touch, way=way, tip_radius=radius)
    first = touch.contours[0]
    at = int(((first.points - touch.contact) ** 2).sum(axis=1).argmin())
    assert first.normals is not None
    contact = first.points[at] + radius * first.normals[at]
    contours = tuple(_in_its_plane(contour, contact, radius) for contour in touch.contours)
    return replace(touch, contact=contact, contours=contours, tip_radius=radius)


def _in_its_plane(contour: Contour, contact, radius: float) -> Contour:
    """The centres of a contour, in the best plane through the contact (3,): that which is stated
    where they are nearly straight."""
    assert contour.normals is not None
    centres = contour.points + radius * contour.normals
    stated, offset = contour.plane.normal, centres - contact
    _, spread, axes = np.linalg.svd(offset, full_matrices=False)
    own = axes[-1] * np.sign(axes[-1] @ stated)
    # Thirty deviations beside a line, they have a plane of their own, which is nearly the stated.
    bends = len(spread) == 3 and spread[1] > 30.0 * np.sqrt(len(centres)) * contour.noise_std
    normal = own if bends and own @ stated > 0.98 else stated
    # The position across the plane is controlled: what is left of it there is no noise.
    centres = centres - (offset @ normal)[:, None] * normal
    return replace(contour, points=centres, plane=SamplingPlane(contact, normal), normals=None)
