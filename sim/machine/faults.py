"""Faults: probes around a probe, each of which does one thing wrong. They compose."""

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from touchatlas.atlas import Touch, TouchStatus
from touchatlas.patch import Contour, ContourEnd, SamplingPlane
from touchatlas.patch.geometry.arrays import cross
from touchatlas.planner import ProbePlan
from touchatlas.sim.machine import fault_words as words
from touchatlas.sim.machine.fault_words import Fault
from touchatlas.sim.machine.feet import Feet
from touchatlas.sim.machine.probes import SimulatedProbe
from touchatlas.sim.world.probe import state_of


class FaultyProbe:
    """A probe with a fault, around another one.

    Parameters
    ----------
    probe : callable from ProbePlan to Touch, with its state
    fault : Fault
    tolerance : float, length
        In which displacements are given.
    feet : Feet
        Of the body, for normals.
    rng : numpy.random.Generator
    """

    def __init__(
        self, probe: SimulatedProbe, fault: Fault, tolerance: float, feet: Feet, rng
    ) -> None:
        self._probe, self._fault, self._rng, self._feet = probe, fault, rng, feet
        # Of a motion or drift: drawn once, so that it is the same after a resume.
        direction = rng.normal(size=3)
        self._shift = fault.size * tolerance * direction / np.linalg.norm(direction)
        self._tolerance = tolerance

    def __call__(self, plan: ProbePlan) -> Touch:
        """The touch of the probe within, spoilt from the fault's first touch on."""
        fault = self._fault
        if plan.number < fault.begins:
            return self._probe(plan)
        if fault.name == words.PLANE:
            return self._in_other_planes(plan)
        if fault.name in (words.MOVED, words.DRIFT):
            times = 1 if fault.name == words.MOVED else plan.number - fault.begins + 1
            return self._moved(plan, times * self._shift)
        touch = self._probe(plan)
        return self._spoilt(touch) if touch.status is TouchStatus.TOUCHED else touch

    def _spoilt(self, touch: Touch) -> Touch:
        """A touch whose contours are other ones; ValueError where these are none of a touch."""
        fault = self._fault
        spoil = {
            words.NOISE: self._noisier,
            words.DISPLACED: self._displaced,
            words.OUTLIERS: self._with_outliers,
            words.LOST: self._lost,
        }
        try:
            if fault.name == words.TIP:
                return self._outside(touch)
            contours = tuple(spoil[fault.name](contour, touch) for contour in touch.contours)
            return replace(touch, contours=contours)
        except ValueError as error:
            wrong = str(error).partition(";")[0]
            raise ValueError(
                f"fault is {fault.name}={fault.size:g}, too much for touch {touch.number} "
                f"({wrong}); give a smaller size"
            ) from None

    def state(self) -> str:
        """That of the probe within, and the random numbers of the fault."""
        return json.dumps({"within": self._probe.state(), "random": self._rng.bit_generator.state})

    def restore(self, state: str) -> None:
        """Go on from a state; ValueError if it is none."""
        with state_of(state) as known:
            within = known["within"]
            self._rng.bit_generator.state = known["random"]
        self._probe.restore(within)

    @property
    def seconds(self) -> float | None:
        """That the machine has taken, s; None of a probe without one."""
        return getattr(self._probe, "seconds", None)

    def _moved(self, plan: ProbePlan, shift: np.ndarray) -> Touch:
        """The touch of an object that has moved by a shift (3,): the probe within knows the object
        where it was."""
        until, way = plan.until, plan.way
        known = None if until is None else lambda points: until(points + shift)

        def ways(start, goal, radius):
            found = None if way is None else way(start + shift, goal + shift, radius)
            return found if found is None else found - shift

        back = replace(
            plan,
            reference_point=plan.reference_point - shift,
            planes=tuple(SamplingPlane(p.point - shift, p.normal) for p in plan.planes),
            until=known,
            way=None if way is None else ways,
        )
        touch = shifted(self._probe(back), shift)
        touched = touch.status is TouchStatus.TOUCHED
        return touch if touched else replace(touch, contact=plan.reference_point)

    def _in_other_planes(self, plan: ProbePlan) -> Touch:
        """The touch of a probe whose planes are turned, each about another axis, and said to be
        the planned ones."""
        angle, planes = np.radians(self._fault.size), []
        for plane in plan.planes:
            axis = self._rng.normal(size=3)
            aside = cross(axis, plane.normal)
            aside /= np.linalg.norm(aside)
            normal = np.cos(angle) * plane.normal + np.sin(angle) * aside
            planes.append(SamplingPlane(plane.point, normal))
        touch = self._probe(replace(plan, planes=tuple(planes)))
        contours = tuple(
            replace(contour, plane=SamplingPlane(contour.plane.point, plane.normal))
            for contour, plane in zip(touch.contours, plan.planes, strict=bool(touch.contours))
        )
        return replace(touch, contours=contours)

    def _noisier(self, contour: Contour, touch: Touch) -> Contour:
        std = contour.noise_std * np.sqrt(max(self._fault.size**2 - 1.0, 0.0))
        return self._off(contour, std * self._rng.normal(size=contour.points.shape))

    def _outside(self, touch: Touch) -> Touch:
        """The touch of a ball whose radius nobody took off: all is where its centre was."""
        contours = tuple(self._off(c, self._outward(c.points)) for c in touch.contours)
        contact = touch.contact + self._outward(touch.contact[None])[0]
        way = touch.way
        if way is not None:
            rise = (contact - touch.contact) @ touch.approach
            way = np.stack([way[0], way[1] + rise * touch.approach])
        return replace(touch, contours=contours, contact=contact, way=way)

    def _outward(self, points) -> np.ndarray:
        """(n, 3) the size of the fault along the normals of the body at points (n, 3)."""
        return self._fault.size * self._feet.normals(self._feet.of(points))

    def _displaced(self, contour: Contour, touch: Touch) -> Contour:
        way = self._rng.normal(size=3)
        way *= self._fault.size * self._tolerance / np.linalg.norm(way)
        return self._off(contour, np.tile(way, (len(contour.points), 1)))

    def _with_outliers(self, contour: Contour, touch: Touch) -> Contour:
        """Some samples are off by up to a hundred deviations of the noise."""
        count = len(contour.points)
        bad = self._rng.random(count) < self._fault.size
        way = self._rng.normal(size=(count, 3))
        way *= 100.0 * contour.noise_std / np.linalg.norm(way, axis=1)[:, None]
        return self._off(contour, (bad * self._rng.random(count))[:, None] * way)

    def _lost(self, contour: Contour, touch: Touch) -> Contour:
        """Arms end early, a few samples from the contact at least."""
        if ContourEnd.CLOSED_LOOP in contour.ends:
            return contour
        points = contour.points
        middle = int(((points - touch.contact) ** 2).sum(axis=1).argmin())
        first, last, ends = 0, len(points), list(contour.ends)
        lose = self._rng.random(2) < self._fault.size
        if lose[0] and middle > 3:
            first, ends[0] = int(self._rng.integers(0, middle - 2)), ContourEnd.LOST_CONTACT
        if lose[1] and middle + 4 < last:
            last = int(self._rng.integers(middle + 3, last))
            ends[1] = ContourEnd.LOST_CONTACT
        normals = None if contour.normals is None else contour.normals[first:last]
        held = (ends[0], ends[1])
        return Contour(points[first:last], contour.plane, contour.noise_std, held, normals)

    def _off(self, contour: Contour, way: np.ndarray) -> Contour:
        """A contour whose points are off by ways (n, 3)."""
        return replace(contour, points=contour.points + way)


def with_faults(
    probe: SimulatedProbe, text: str, tolerance: float, feet: Callable[[], Feet], rng
) -> SimulatedProbe:
    """A probe with the faults that a text names, the first within the others; ``feet`` makes those
    of the body, if there is a fault.

    Parameters
    ----------
    probe : SimulatedProbe
    text : str
        See ``RunOptions``.
    tolerance : float, length
    feet : function without arguments to Feet
    rng : numpy.random.Generator
    """
    faults = words.faults_of(text)
    body = feet() if faults else None
    for fault in faults:
        assert body is not None
        probe = FaultyProbe(probe, fault, tolerance, body, rng)
    return probe


def shifted(touch: Touch, shift) -> Touch:
    """A touch of the object moved by a shift (3,), length."""
    contours = tuple(
        replace(
            contour,
            points=contour.points + shift,
            plane=SamplingPlane(contour.plane.point + shift, contour.plane.normal),
        )
        for contour in touch.contours
    )
    way = None if touch.way is None else touch.way + shift
    return replace(touch, contact=touch.contact + shift, contours=contours, way=way)
