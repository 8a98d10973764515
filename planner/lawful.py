"""Lawful: where to touch a body whose faces obey laws."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.faces.lawful_body import LawfulBody
from touchatlas.atlas.mesh.lawful_surface import fine_edge
from touchatlas.planner.options import PlannerOptions
from touchatlas.planner.place.choose import Target, View
from touchatlas.planner.place.known_area import KnownArea
from touchatlas.planner.place.lawful_places import LawfulPlaces, lawful_places, rim_target, weak_target
from touchatlas.planner.place.places import apart_from_each_other

# Numbers of faces, edges and rounded edges where there is no body.
NO_BODY = (0, 0, 0)


@dataclass(frozen=True, eq=False)
class Lawful:
    """Where to touch a body whose faces obey laws: where its surface ends, else where too little is
    known.

    Parameters
    ----------
    body : LawfulBody
    """

    body: LawfulBody

    @cached_property
    def places(self) -> LawfulPlaces:
        """The places of a coarse surface of the body."""
        return lawful_places(self.body)

    def areas(self, view: View) -> tuple[float, float, float]:
        """See ``LawfulPlaces.areas``."""
        untried = view.is_untried(self.places.rim)
        return self.places.areas(view.atlas.tolerance, view.places.deviation_ratio, untried)

    def left(self, view: View) -> np.ndarray:
        """(k, 3) places that are open or not known to the tolerance, far apart from each other."""
        return apart_from_each_other(self.places.left(view.atlas.tolerance), view.extent)

    def target(
        self, view: View, known: KnownArea, options: PlannerOptions, _: np.random.Generator | None
    ) -> tuple[Target | None, bool]:
        """Where to touch next, if anywhere, and whether the surface is known."""
        enough = known.coverage >= options.coverage
        if known.stagnates():
            return None, enough
        target = rim_target(view, self.places)
        if target is None and not enough:
            target = weak_target(view, self.places)
        if target is None:
            target = rim_target(view, self._fine_places(view))
        return target, enough

    def _fine_places(self, view: View) -> LawfulPlaces:
        """Places of the surface that is drawn at the end, which may show smaller holes."""
        edge = fine_edge(self.body, view.atlas.options.facets * view.atlas.tolerance)
        return lawful_places(self.body, edge)


def structure_of(faces: Faces) -> tuple[int, int, int]:
    """Numbers of faces, edges and rounded edges: where one changes, so does the surface."""
    rounded = sum(edge.radius > 0.0 for edge in faces.edges)
    return len(faces), len(faces.edges), rounded
