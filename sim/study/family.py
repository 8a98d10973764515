"""A family: a way to make a touch hard, in steps of severity from easy to hard."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from touchatlas.sim.study.cases import Case, even_plan, placed, touch_graph
from touchatlas.sim.study.heights import Height, wavy

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

    def case(self, name: str, severity: float, draw: int, seed: int):
        """Case number ``draw`` of the family called ``name``, and its generator.

        It depends on the seed, the name, the place of the severity and the number alone.
        """
        place = self.severities.index(severity)
        rng = np.random.default_rng([seed, *name.encode(), place, draw])
        return self.draw(severity, rng), rng


def entering(families: dict[str, Family[Drawn]]):
    """A decorator of functions of severity and generator, which enters them in a table, each under
    its own name."""

    def family(title: str, *severities: float):
        def enter(draw: Callable[[float, np.random.Generator], Drawn]):
            families[draw.__name__] = Family(title, severities, draw)
            return draw

        return enter

    return family


def random_turn(rng: np.random.Generator, most: float = np.pi) -> float:
    """An angle, rad."""
    return float(rng.uniform(0.0, most))


def anywhere(height: Height, rng: np.random.Generator, **changes) -> Case:
    """A touch of a graph at its origin, by an even plan with changes."""
    return placed(touch_graph(height, even_plan(rng, **changes), rng), rng)


def smooth(rng: np.random.Generator, **changes) -> Case:
    """A touch of a smooth random surface, by an even plan with changes."""
    return anywhere(wavy(rng), rng, **changes)
