"""Hybrid control of force and position: a ball tip tracks the surface within any plane.

At the contact there is a frame of three directions: the plane's normal w, in which position is
controlled; the normal n of the section within the plane, in which force is controlled; and w x n
along the section, in which the tip is fed.

Raibert and Craig, Hybrid position/force control of manipulators, ASME J. Dynamic Systems,
Measurement, and Control 103 (1981); Mason, Compliance and force control for computer controlled
manipulators, IEEE Trans. SMC 11 (1981).
"""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.geometry.arrays import cross
from touchatlas.planner.tracking.machines import Reading
from touchatlas.planner.tracking.options import Tip, TrackingOptions


@dataclass(frozen=True, eq=False)
class ControlState:
    """What the control of m tips remembers from one reading to the next.

    Parameters
    ----------
    time : float, s
        Of the last reading.
    force : (m, 3) float, N, world
        Filtered.
    normal : (m, 3) float, unit, world
        Of the section, out of the body, within the plane.
    error_sum : (m,) float, length s
        Integral of the bending that is missing.
    weak : (m,) float, s
        How long the force has been below the least one.
    met : (m, 3) float, length, world
        Centre where contact was last.
    sought : (m,) float, length
        How far a lost surface was sought.
    speed : (m,) float, length/s
        Along the surface.
    travelled : (m,) float, length
        Along the surface, in contact.
    """

    time: float
    force: np.ndarray
    normal: np.ndarray
    error_sum: np.ndarray
    weak: np.ndarray
    met: np.ndarray
    sought: np.ndarray
    speed: np.ndarray
    travelled: np.ndarray

    @classmethod
    def at_rest(cls, reading: Reading, normal: np.ndarray, tip: Tip) -> "ControlState":
        """That of tips in contact that do not move yet; normals (m, 3)."""
        none, met = np.zeros(len(normal)), centre_of(reading, tip)
        force, normal = np.array(reading.force, float), np.array(normal, float)
        return cls(reading.time, force, normal, none, none, met, none, none, none)


def centre_of(reading: Reading, tip: Tip) -> np.ndarray:
    """(..., 3) centre of the tip: where the stylus would hold it, and its bending.

    c = p + F / k, as the paper's section 3 compensates the bending of its beam.

    >>> centre_of(Reading(0.0, np.zeros(3), np.array([0.0, 0.0, 0.4])), Tip(stiffness=2.0))
    array([0. , 0. , 0.2])
    """
    centre: np.ndarray = reading.position + reading.force / tip.stiffness
    return centre


def hybrid_control(
    reading: Reading,
    plane_point: np.ndarray,
    plane_normal: np.ndarray,
    feed: np.ndarray | float,
    tip: Tip,
    options: TrackingOptions,
    state: ControlState,
) -> tuple[np.ndarray, ControlState]:
    """The next velocity of m tips, and what is to be remembered.

    Parameters
    ----------
    reading : Reading
        Of positions and forces (m, 3).
    plane_point, plane_normal : (m, 3) float, length; unit, world
        The tips travel along plane normal x section normal.
    feed : (m,) float, or one for all
        Share of the feed of the options: 0 presses without travel.
    tip : Tip
    options : TrackingOptions
    state : ControlState

    Returns
    -------
    velocity : (m, 3) float, length/s
    state : ControlState
    """
    # What is longer is a gap, in which the integral does not grow.
    seconds = min(max(reading.time - state.time, 0.0), 0.1)
    # A low pass of first order.
    share = 1.0 - np.exp(-2.0 * np.pi * options.filter * seconds)
    w, force = plane_normal, state.force + share * (reading.force - state.force)
    total = np.sqrt((force * force).sum(axis=1))
    normal = _section_normal(force, w, state.normal, options.least)
    weak = np.where(total < options.least, state.weak + seconds, 0.0)
    lost = weak > options.lost_after
    missing = (options.force - total) / tip.stiffness
    # What the integral may hold presses no faster than the search.
    most = options.search_speed / options.integral
    error_sum = np.where(lost, 0.0, np.clip(state.error_sum + missing * seconds, -most, most))
    press = options.gain * missing + options.integral * error_sum
    centre = centre_of(reading, tip)
    met = np.where((total < options.least)[:, None], state.met, centre)
    # Tips slow down while the force is off.
    off = np.abs(missing) * tip.stiffness / options.force
    speed = feed * options.feed * np.clip(1.0 - off, options.slowest, 1.0) * ~lost
    speed = np.minimum(speed, state.speed + options.acceleration * seconds)
    beside = ((centre - plane_point) * w).sum(axis=1)
    pressing = speed[:, None] * cross(w, normal) - press[:, None] * normal
    seeking = options.search_speed * _sought(centre - met, w, normal, tip.radius)
    velocity = np.where(lost[:, None], seeking, pressing) - (options.hold * beside)[:, None] * w
    sought = np.where(lost, state.sought + options.search_speed * seconds, 0.0)
    travelled = state.travelled + speed * seconds
    return velocity, ControlState(
        reading.time, force, normal, error_sum, weak, met, sought, speed, travelled
    )


def _sought(away, w, normal, radius: float) -> np.ndarray:
    """(m, 3) unit directions in which tips seek a surface that they have lost, from where they are
    off the place of the last contact by ``away`` (m, 3): against the normal there, and farther than
    a radius on a circle about that place.

    A section goes on from there, and the circle, turned toward the body, meets it.
    """
    inside = away - (away * w).sum(axis=1)[:, None] * w
    length = np.sqrt((inside * inside).sum(axis=1))[:, None]
    return np.where(length < radius, -normal, cross(w, inside / np.maximum(length, 1e-300)))


def leaving(reading: Reading, options: TrackingOptions) -> np.ndarray:
    """(m, 3) velocities, length/s, of m tips that leave the surface along its forces on them; 0
    where there is no contact.

    >>> force = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 0.01]])
    >>> leaving(Reading(0.0, np.zeros((2, 3)), force), TrackingOptions(approach=5.0))
    array([[0., 0., 5.],
           [0., 0., 0.]])
    """
    size = np.sqrt((reading.force * reading.force).sum(axis=1))[:, None]
    away = np.where(size > options.least, options.approach / np.maximum(size, 1e-300), 0.0)
    velocity: np.ndarray = away * reading.force
    return velocity


def _section_normal(force, w, before, least: float) -> np.ndarray:
    """(m, 3) directions of the forces within the planes; the normals before where there is no
    force that has a direction."""
    inside = force - (force * w).sum(axis=1)[:, None] * w
    length = np.sqrt((inside * inside).sum(axis=1))[:, None]
    return np.where(length > 0.5 * least, inside / np.maximum(length, 1e-300), before)
