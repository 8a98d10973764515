"""Doubts about edges of which no contour shows whether they are sharp or rounded."""

from touchatlas.atlas.body.guessed_edges import guessed_edges
from touchatlas.atlas.check.doubt import Doubt, count_of, extent_of, some_apart
from touchatlas.atlas.state import AtlasState


def edge_doubts(atlas: AtlasState) -> list[Doubt]:
    """One doubt where edges are drawn sharp by a guess."""
    if atlas.body is None:
        return []
    guessed = guessed_edges(atlas.body, atlas.tolerance)
    if not len(guessed.points):
        return []
    words = (
        f"{count_of(len(guessed.points), 'edge is', 'edges are')} drawn sharp that no contour "
        f"crossed, though most are rounded, by {guessed.radius:.3g} in the median; touch there."
    )
    places = some_apart(guessed.points, extent_of(atlas.pool.points))
    return [Doubt("guessed edges", words, places)]
