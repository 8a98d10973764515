"""Boundaries between the pieces of a labelling."""

import numpy as np

from touchatlas.atlas.edges.blunt_edges import Rounding
from touchatlas.atlas.edges.boundary import Boundary
from touchatlas.atlas.edges.boundary_judge import LEAST_POINTS, NEAR, BoundaryJudge
from touchatlas.atlas.edges.corner_edges import pairs_at_corners
from touchatlas.atlas.edges.label_pairs import pairs_across_ends, pairs_across_links
from touchatlas.atlas.labels.labels import Labels

# Distance of the edges of two pieces with a third from the corner of all three, in steps. Doubled,
# edges between fewer touches are found.
_CORNER = 8.0


def find_boundaries(labels: Labels) -> list[Boundary]:
    """All boundaries between the pieces of a labelling, in order of their labels."""
    judge = BoundaryJudge(labels)
    blunt = {(edge.first, edge.second): edge for edge in Rounding(labels).edges}
    judge.rounded[[i for edge in blunt.values() for i in edge.samples.tolist()]] = True
    links = pairs_across_links(labels)
    found = {pair: judge.between(*pair, middles) for pair, middles in links.items()}
    for pair, ends in pairs_across_ends(labels, NEAR * judge.step, _CORNER * judge.step).items():
        if found.get(pair) is None:
            middles = np.concatenate([links[pair], ends]) if pair in links else ends
            lawful = all(labels.pieces[k].kind.lawful for k in pair)
            found[pair] = judge.uncrossed(*pair, middles, points=1 if lawful else LEAST_POINTS)
    edges = {pair: b.curve.points for pair, b in found.items() if b is not None and b.kind.sharp}
    corners = pairs_at_corners(labels.pieces, edges, _CORNER * judge.step)
    for pair in sorted(corners.keys() - {pair for pair, b in found.items() if b is not None}):
        found[pair] = judge.between_corners(*pair, corners[pair])
    for pair, edge in blunt.items():
        found[pair] = judge.blunt(edge, found.get(pair))
    return [boundary for _, boundary in sorted(found.items()) if boundary is not None]
