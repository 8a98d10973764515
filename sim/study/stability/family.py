"""A family: one way in which a fit may fail, in steps of severity."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from touchatlas.sim.study.stability.case import Case
from touchatlas.sim.study.stability.surfaces import Height, wavy
from touchatlas.sim.study.stability.tracking import Plan, even_angles, placed, touch_graph

# A Case of one patch, or the Trial of an exploration.
Drawn = TypeVar("Drawn")


@dataclass(frozen=True)
class Family(Generic[Drawn]):
    """Cases that differ in one number.

    Parameters
    ----------
    title : str
        What grows with the severity, and its unit.
    severities : tuple of float
        From easy to hard.
    draw : callable
        (severity, generator) to a Case, or to a Trial.
    """

    title: str
    severities: tuple[float, ...]
    draw: Callable[[float, np.random.Generator], Drawn]


# Lean of the sampling planes of a careful touch, rad: up to ten degrees.
_LEAN = np.pi / 18.0


def even_plan(rng: np.random.Generator, **changes) -> Plan:
    """Three curves 60 degrees apart, their planes nearly upright."""
    tilts = tuple(_LEAN * rng.uniform(-1.0, 1.0, 3))
    return Plan(**({"angles": even_angles(rng), "tilts": tilts} | changes))


def anywhere(height: Height, rng: np.random.Generator, **changes) -> Case:
    """A touch of a graph at its origin, by an even plan with changes."""
    return placed(touch_graph(height, even_plan(rng, **changes), rng), rng)


def smooth(rng: np.random.Generator, **changes) -> Case:
    """A touch of a smooth random surface, by an even plan with changes."""
    return anywhere(wavy(rng), rng, **changes)
