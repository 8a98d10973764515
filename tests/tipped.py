"""Touches of a ball tip on bodies whose offsets are known in closed form.

The distance from a union is the least of the distances, so its offset is the union of offsets.
"""

from dataclasses import replace

import numpy as np

from touchatlas.atlas import Atlas, Touch, TouchStatus
from touchatlas.planner import Planner, ProbePlan, explore
from touchatlas.sim import Probe
from touchatlas.sim.world.implicit_fields import (
    Field,
    quadric_with_bumps,
    rounded_box,
    torus,
    union,
)
from touchatlas.sim.world.implicit_object import ImplicitObject

NOISE = 0.02
# Half sides of a slab and of the block on it; they meet in concave corners.
SLAB, BLOCK, LIFT = np.array([40.0, 30.0, 10.0]), np.array([20.0, 30.0, 10.0]), 15.0


def centres_of(name: str, radius: float) -> ImplicitObject:
    """The body whose surface is that of the centres of a ball of a radius on a body of a name:
    ball of 33, ring of 40 and 15, cube of 60, or step. Contacts for a radius of zero."""
    # Of a sharp box the closed form of the rounded one has no direction.
    fillet = max(radius, 1e-9)
    fields = {
        "ball": lambda: quadric_with_bumps((33.0 + radius,) * 3),
        "ring": lambda: torus(40.0, 15.0 + radius),
        "cube": lambda: rounded_box((30.0 + radius,) * 3, fillet),
        "step": lambda: union(
            rounded_box(SLAB + radius, fillet), _lifted(rounded_box(BLOCK + radius, fillet), LIFT)
        ),
    }
    half = np.full(3, 60.0 + radius)
    return ImplicitObject(name, name, fields[name](), half, NOISE, 1.0)


def _lifted(field: Field, height: float) -> Field:
    """The field of a body that is higher along z."""
    up = np.array([0.0, 0.0, height])
    return Field(lambda p: field.first_order(p - up), lambda p: field.hessian(p - up))


class TipProbe:
    """A probe with a ball tip, asked for places of its centre.

    Parameters
    ----------
    name : str
        See ``centres_of``.
    radius : float, length
        Of the ball.
    stated : float, length, optional
        The radius that it states; the true one without.
    systematic_std : float, length
    are_contacts : bool
        Whether it gives contacts with normals, and not centres.
    """

    def __init__(
        self, name, radius, stated=None, systematic_std=0.0, are_contacts=False, seed=0
    ) -> None:
        self.body = centres_of(name, radius)
        self._probe = Probe(self.body, NOISE, np.random.default_rng(seed))
        self._stated = radius if stated is None else stated
        self._std, self._are_contacts = systematic_std, are_contacts

    def __call__(self, plan: ProbePlan) -> Touch:
        touch = replace(self._probe(plan), systematic_std=self._std)
        if not self._are_contacts:
            return replace(touch, tip_radius=self._stated)
        if touch.status is not TouchStatus.TOUCHED:
            return touch
        contours = []
        for contour in touch.contours:
            normals = self.body.normal(contour.points)
            points = contour.points - self._stated * normals
            contours.append(replace(contour, points=points, normals=normals))
        contact = touch.contact - self._stated * self.body.normal(touch.contact[None])[0]
        return replace(touch, contact=contact, contours=tuple(contours))


def explored(probe: TipProbe, tolerance: float, most: int | None = None) -> tuple[Atlas, Planner]:
    """Atlas and planner of an exploration of the centres of a probe."""
    atlas, planner = Atlas(tolerance), Planner(*probe.body.start())
    for _ in explore(atlas, planner, probe, most):
        pass
    return atlas, planner
