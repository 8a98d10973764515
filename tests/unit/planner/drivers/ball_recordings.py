"""Recordings of a robot that tracks great circles of a ball about 0, in closed form."""

import numpy as np

from touchatlas.planner.drivers.recording import Recording
from touchatlas.planner.tracking.options import Tip

BALL, FRICTION, FORCE, FEED, RATE = 30.0, 0.15, 0.4, 10.0, 100.0
TIP = Tip(radius=2.0, stiffness=2.0, noise_std=0.01, force_std=0.005)


def arm(place, along, length, rng, end="lift"):
    """Readings of an arm along a great circle of a ball about 0: air, contact, air. The force has
    friction against the travel; the beam bends by F / k."""
    period = 1.0 / RATE
    turn = np.arange(0.0, length / (BALL + TIP.radius), FEED * period / (BALL + TIP.radius))
    n = np.outer(np.cos(turn), place) + np.outer(np.sin(turn), along)
    t = np.outer(np.cos(turn), along) - np.outer(np.sin(turn), place)
    force = FORCE * (n - FRICTION * t)
    centres = (BALL + TIP.radius) * n
    height = np.linspace(5.0, 0.1, 30)[:, None]
    leave = n[-1] if end == "lift" else t[-1]
    positions = np.vstack(
        [
            centres[0] + height * n[0],
            centres - force / TIP.stiffness,
            centres[-1] + height[::-1] * leave,
        ]
    )
    forces = np.vstack([np.zeros((30, 3)), force, np.zeros((30, 3))])
    positions = positions + TIP.noise_std * rng.normal(size=positions.shape)
    return positions, forces + TIP.force_std * rng.normal(size=forces.shape)


def recording(places, length=25.0, end="lift", planes=3, seed=0):
    """At each place three planes, both ways each."""
    rng = np.random.default_rng(seed)
    rows = []
    for place in places:
        across = np.cross(place, [0.3, 0.5, 0.8])
        across /= np.linalg.norm(across)
        other = np.cross(place, across)
        for k in range(planes):
            a = np.pi * k / planes
            along = np.cos(a) * across + np.sin(a) * other
            rows += [arm(place, s * along, length, rng, end) for s in (1.0, -1.0)]
    positions, forces = (np.vstack(column) for column in zip(*rows, strict=True))
    return Recording(np.arange(len(positions)) / RATE, positions, forces)
