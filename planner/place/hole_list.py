"""HoleList: the holes of the surface that are left to touch, the same for all tolerances."""

from collections.abc import Callable

import numpy as np

from touchatlas.planner.place.choose import APART_HOLES, Target, View, distance_to
from touchatlas.planner.place.holes import NO_HOLES, Holes, drawn_holes
from touchatlas.planner.probe_plan import Reason

# Largest level, in extents: a surface known to it is nearly whole. Doubled, the surface is drawn
# once more, when less of it is known.
_FIRST = 0.05
# Least level, in the scale of the atlas: a tenth of it is half a standard deviation of the noise.
# Doubled, explorations to tolerances below the noise look once less.
_LAST = 0.1
# How often the surface is drawn at one level. Doubled, some more holes are closed, and explorations
# that leave many take longer.
_LOOKS = 4
# Holes that are touched before the surface is drawn again. Doubled, more touches find their holes
# closed already.
_HOLES = 16

# Whether the share of the surface that is asked for is known to a length.
Sure = Callable[[float], bool]


class HoleList:
    """The holes of the surface, drawn each time the surface is known twice as well as before.

    The *level* is the length to which the surface is known, up to a factor of two. What is drawn
    and what is touched follow from it alone, never from the tolerance that is asked.
    """

    def __init__(self) -> None:
        self.level = np.inf
        self._drawn = NO_HOLES
        self._looks = 0

    @property
    def looks_left(self) -> bool:
        """Whether the surface may be drawn again at this level."""
        return self._looks < _LOOKS

    @property
    def begun(self) -> bool:
        """Whether so much is known that the surface was drawn."""
        return bool(np.isfinite(self.level))

    def update(self, view: View, sure: Sure) -> None:
        """Draw the surface where it is known twice as well as when it was drawn last, or where the
        holes that were worth a touch are touched; ``sure`` tells what is known."""
        level = self._known_level(view, sure)
        if level < self.level:
            self.level, self._looks = level, 0
            self._draw(view)
        elif self.begun and self.looks_left and self._is_over(view, sure):
            self._draw(view)

    def draw_to(self, view: View, tolerance: float) -> None:
        """Draw the surface to a tolerance where no hole is left, to be the last."""
        self.level = min(self.level, tolerance)
        if self.looks_left and not _left(self._drawn, view).any():
            self._draw(view)

    def target(self, view: View, sure: Sure) -> Target | None:
        """The hole of largest error if that is more than the surface is known to; of several that
        farthest from touches and attempts."""
        left = _left(self._drawn, view)
        if not left.any():
            return None
        worst = left & (self._drawn.error == self._drawn.error[left].max())
        best = int(np.where(worst, view.apart(self._drawn.centres), -1.0).argmax())
        if not sure(float(self._drawn.error[best])):
            return None
        return Target(self._drawn.centres[best], self._drawn.normals[best], Reason.CLOSE_GAP)

    def any_left(self, view: View, tolerance: float) -> bool:
        """Whether a hole may be left that a drawn surface would not close to a tolerance."""
        left = _left(self._drawn, view)
        return not self.begun or bool((self._drawn.error[left] > tolerance).any())

    def _known_level(self, view: View, sure: Sure) -> float:
        """The level now: halved as long as the surface is known to that."""
        level = self.level if self.begun else _FIRST * view.extent
        if not (self.begun or sure(level)):
            return self.level
        least = _LAST * view.atlas.scale
        while level > least and sure(0.5 * level):
            level *= 0.5
        return level

    def _is_over(self, view: View, sure: Sure) -> bool:
        """Whether holes were drawn that are worth a touch, and all of them are touched or crossed
        since."""
        gone = ~_left(self._drawn, view)
        if not gone.any() or self.target(view, sure) is not None:
            return False
        return sure(float(self._drawn.error[gone].max()))

    def _draw(self, view: View) -> None:
        """Draw the surface; the worst holes are listed."""
        self._looks += 1
        found = drawn_holes(view.atlas, self.level)
        apart = view.apart(found.centres)
        order = np.lexsort((-apart, -found.error))
        self._drawn = found.taken(order[apart[order] > APART_HOLES * view.extent][:_HOLES])


def _left(holes: Holes, view: View) -> np.ndarray:
    """(k,) whether holes are away from touches and attempts, and no contour crossed them since they
    were drawn."""
    if not len(holes.error):
        return np.zeros(0, bool)
    since = view.atlas.membership.pool.points[holes.samples :]
    crossed = distance_to(since, holes.centres) <= holes.radius
    return ~crossed & (view.apart(holes.centres) > APART_HOLES * view.extent)
