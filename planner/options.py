"""PlannerOptions: what a planner is asked for, how it touches, and the levels it decides by."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.checks import check_above, check_whole, names_of
from touchatlas.patch.entry_points import PLANNERS, added
from touchatlas.patch.geometry.arrays import real
from touchatlas.planner.cost_model import CostModel
from touchatlas.planner.region import region_of

# How the next place is chosen: ours, and baselines to compare with.
TOLERANCE = "tolerance"
NAMES = (TOLERANCE, "random", "farthest", "variance")


@dataclass(frozen=True)
class PlannerLevels:
    """Levels that a planner decides by. Each keeps its meaning on a body of any size.

    Parameters
    ----------
    apart : float
        Distance from a touch or attempt within which no other is made, in extents of what is
        touched so far: every exploration ends. Twice as much leaves narrow features out.
    about : float
        Distance about a place that one touch makes known, in extents.
    set_up : float
        Cost of a touch besides the way to it, in extents of way.
    surest : float
        Deviation of a place that needs no touch, in deviations of a sample: about a dozen samples
        give it.
    known : float
        Deviation at which arms may end, in scales of the atlas.
    closer : float
        Factor by which arms and steps shrink where contours were too short.
    behind : float
        Area expected behind an opening, over that of the unknown strip beside its rim, where no
        touch has found any yet.
    hidden_hole : float
        Radius of the smallest hole that is looked for between samples, in extents.
    room : float
        What ways between touches keep clear of, besides the tip, in extents.
    patience : int
        Touches, or a quarter of all if that is more, without growth after which the exploration
        stagnates.
    growth : float
        Least fraction of the surface that is worth a touch.
    """

    apart: float = 0.02
    about: float = 0.1
    set_up: float = 0.3
    surest: float = 0.3
    known: float = 0.36
    closer: float = 0.35
    behind: float = 4.0
    hidden_hole: float = 0.025
    room: float = 0.02
    patience: int = 16
    growth: float = 1.25e-4

    def __post_init__(self) -> None:
        check_above(self, positive=names_of(self))
        if not isinstance(self.patience, int | np.integer):
            raise ValueError(f"patience is {self.patience!r}; it must be a whole number of touches")
        if not self.closer < 1.0:
            raise ValueError(f"closer is {self.closer!r}; it must be less than 1")


@dataclass(frozen=True)
class PlannerOptions:
    """What a planner is asked for, and how it touches.

    Parameters
    ----------
    name : str
        Which place is touched next: "tolerance", or for comparison "random", "farthest",
        "variance", or what a package adds, as "oracle", which knows a simulated object.
    coverage : float
        Expected fraction of the surface within the tolerance at which it is known.
    curves : int
        Sampling planes per touch.
    reach : float
        Longest arm of a contour, in extents of what is touched so far.
    step : float
        Arc length between samples, in the same extents.
    step_turn : float, rad
        Turn from one sample to the next beyond which the step is halved, up to three times.
    max_turn : float, rad
        Largest angle by which a contour may turn from the contact to its end.
    search : int
        Approaches along rays past what is known, when nothing else is left, in search of other
        parts. Parts smaller than a fifth of the extent may be missed.
    pin_radius : float, length
        Radius of the straight pin that holds the tip and comes along the normal; none is 0. Where
        it would pass through what is known, no touch is planned.
    pin_length : float, length
        Length of the pin, more than its radius; given together with it.
    styli : str
        Directions from the tip to its holder of a machine that cannot turn its pin: X,Y,Z, or
        several with ; between them. Empty where the pin comes along the normal.
    region : str
        Where the surface is wanted: box:X,Y,Z,X,Y,Z (two corners), ball:X,Y,Z,RADIUS, or the path
        of a closed mesh; everywhere where it is empty.
    elsewhere : float, length
        Tolerance outside of the region; 0 where the surface is not wanted there.
    feature : float, length
        Diameter of the smallest hole or horn that is not to be missed: touches go on until no disc
        of this diameter on the surface is without a sample. 0 asks for none.
    datum : int
        Touches after which the first place is touched again, which shows whether the object or the
        probe has moved; never where it is 0.
    cost : CostModel
        What a machine takes for a touch, in seconds.
    levels : PlannerLevels
        Levels that it decides by.
    """

    name: str = TOLERANCE
    coverage: float = 0.995
    curves: int = 3
    reach: float = 0.6
    step: float = 0.014
    step_turn: float = np.pi / 12.0
    max_turn: float = 2.0 * np.pi / 3.0
    search: int = 0
    pin_radius: float = 0.0
    pin_length: float = 0.0
    styli: str = ""
    region: str = ""
    elsewhere: float = 0.0
    feature: float = 0.0
    datum: int = 0
    cost: CostModel = CostModel()
    levels: PlannerLevels = PlannerLevels()

    def __post_init__(self) -> None:
        # What other packages add is looked for where the name is none of ours.
        known = isinstance(self.name, str) and (self.name in NAMES or self.name in added(PLANNERS))
        if not known:
            names = ", ".join((*NAMES, *added(PLANNERS)))
            raise ValueError(f"the planner is {self.name!r}; it must be one of {names}")
        for name, least, most in (("curves", 3, 36), ("search", 0, 1000), ("datum", 0, 1000)):
            check_whole(self, name, least, most)
        self._check_region()
        check_above(self, names=("pin_radius", "pin_length", "elsewhere", "feature"))
        if not (
            self.pin_length == self.pin_radius == 0.0 or 0.0 < self.pin_radius < self.pin_length
        ):
            raise ValueError(
                f"pin_radius, pin_length are {self.pin_radius}, {self.pin_length}; give both, the "
                "length more than the radius"
            )
        if self.styli and not self.pin_length:
            raise ValueError(f"styli is {self.styli!r}; it needs pin_radius and pin_length")
        styli_of(self.styli)
        limits = {"coverage": 1.0, "reach": 10.0, "step": 0.2, "max_turn": np.pi}
        for name, limit in {**limits, "step_turn": np.pi}.items():
            value = getattr(self, name)
            if not 0.0 < real(value) < limit:
                raise ValueError(
                    f"{name} is {value!r}; it must be greater than 0 and less than {limit:.4g}"
                )
        if not 4.0 * self.step <= self.reach:
            raise ValueError(
                f"step, reach are {self.step}, {self.reach}; an arm must have four steps or more"
            )
        if not isinstance(self.cost, CostModel):
            raise ValueError(f"cost is {self.cost!r}; it must be a CostModel")
        if not isinstance(self.levels, PlannerLevels):
            raise ValueError(f"levels are {self.levels!r}; they must be PlannerLevels")

    def _check_region(self) -> None:
        """Refuse a region that is none, and another tolerance without one."""
        if not isinstance(self.region, str):
            raise ValueError(f"region is {self.region!r}; it must be text")
        if self.region:
            region_of(self.region)
        elif self.elsewhere:
            raise ValueError(f"elsewhere is {self.elsewhere!r}; it needs a region")


def styli_of(text: str) -> np.ndarray:
    """(k, 3) unit vectors that a text names; none where it is empty.

    Raises
    ------
    ValueError
        When the text names no directions.

    Examples
    --------
    >>> styli_of("0,0,2;1,0,0").tolist()
    [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    """
    try:
        rows = [[float(x) for x in word.split(",")] for word in text.split(";") if word.strip()]
        found = np.array(rows, float).reshape(-1, 3)
    except (AttributeError, ValueError):
        found = np.full((1, 3), np.nan)
    length = np.sqrt((found * found).sum(axis=1))
    if not (np.isfinite(length).all() and (length > 0.0).all()):
        raise ValueError(f"styli is {text!r}; it must be directions, as 0,0,1 or 0,0,1;1,0,0")
    unit: np.ndarray = found / length[:, None]
    return unit
