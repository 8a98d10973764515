"""One exploration of a family: what is touched, how, and what came of it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from touchatlas.atlas import Atlas, Surface, Touch, extract_surface
from touchatlas.atlas.check.doubt import Doubt
from touchatlas.atlas.check.doubts import doubts
from touchatlas.patch import SamplingPlane
from touchatlas.planner import Planner, explore
from touchatlas.planner.stop import StopReason
from touchatlas.sim.folder.run_options import fit_scale
from touchatlas.sim.study.stability_atlas.bodies import Placed
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.probe import Probe

# Most touches of one exploration: what a box with fillets takes, and four times what a smooth body
# does. Doubled, hopeless explorations take twice as long.
MOST_TOUCHES = 120

Body = ImplicitObject | MeshObject | Placed


@dataclass(frozen=True, eq=False)
class Trial:
    """What is explored.

    Parameters
    ----------
    body : Body
    tolerance, noise : float, length
    change : callable
        (number, touch) to the touch that the atlas gets instead.
    again : callable, optional
        All touches of the exploration to those that a new atlas learns instead.
    """

    body: Body
    tolerance: float
    noise: float
    change: Callable[[int, Touch], Touch] = lambda number, touch: touch
    again: Callable[[list[Touch]], list[Touch]] | None = None


@dataclass(frozen=True, eq=False)
class Explored:
    """What came of a trial.

    Parameters
    ----------
    surface : Surface or None
        None where nothing was touched.
    doubts : tuple of Doubt
    touches : int
    stopped : str
        Why it ended.
    """

    surface: Surface | None
    doubts: tuple[Doubt, ...]
    touches: int
    stopped: str


def explored(trial: Trial, rng: np.random.Generator) -> Explored:
    """Explore as a run does, and ask the atlas what it doubts."""
    atlas, planner = _new_atlas(trial), Planner(*trial.body.start())
    probe = Probe(trial.body, trial.noise, rng)  # type: ignore[arg-type]
    touches: list[Touch] = []

    def changed(plan):
        touches.append(trial.change(plan.number, probe(plan)))
        return touches[-1]

    for _ in explore(atlas, planner, changed, MOST_TOUCHES):
        pass
    stop = planner.stop
    forecast = planner.forecast(atlas) if stop is None else stop.forecast
    if trial.again is not None:
        atlas = _new_atlas(trial)
        for touch in trial.again(touches):
            atlas.add(touch)
        forecast = Planner(*trial.body.start()).forecast(atlas)
    atlas.finish()
    surface = extract_surface(atlas) if len(atlas) else None
    reason = "most touches were made" if stop is None else stop.reason.value
    known = stop is not None and stop.reason is StopReason.KNOWN
    known &= trial.again is None or forecast.predicted_coverage >= planner.options.coverage
    places = () if known else forecast.open_places
    found = doubts(atlas, surface, places, "" if known else reason)
    return Explored(surface, found, len(touches), reason)


def _new_atlas(trial: Trial) -> Atlas:
    return Atlas(trial.tolerance, scale=fit_scale(trial.noise, trial.body.diagonal))


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
