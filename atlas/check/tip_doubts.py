"""Doubts about the tip: corners that it did not enter, and a radius that cannot be right."""

import numpy as np

from touchatlas.atlas.check.doubt import NOWHERE, Doubt, some_apart
from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.state import AtlasState
from touchatlas.patch.geometry.arrays import box_diagonal
from touchatlas.patch.geometry.normal_error import MOST_TILT, SURE
from touchatlas.patch.words import count_of


def tip_doubts(atlas: AtlasState) -> list[Doubt]:
    """What speaks against the tip by which an atlas was touched."""
    if atlas.body is None:
        return []
    return [*_closed_corners(atlas), *_sharper_edges(atlas), *_systematic(atlas)]


def _closed_corners(atlas: AtlasState) -> list[Doubt]:
    """One doubt where a ball did not enter concave corners."""
    places, depths = closed_corners(atlas)
    if not len(places):
        return []
    kept = some_apart(places[np.argsort(-depths, kind="stable")], atlas.pool.extent)
    words = (
        "The ball at the tip did not enter concave corners: what lies there, up to "
        f"{depths.max():.3g} deeper than the ball, is not known; take a smaller tip."
    )
    return [Doubt("closed corners", words, kept)]


def closed_corners(atlas: AtlasState) -> tuple[np.ndarray, np.ndarray]:
    """Middles (k, 3) of the gaps between contacts of a ball in concave corners, and how much deeper
    than the ball the sharp corner is, (k,), length.

    From one contact to the next, normals turn by t toward each other, more than in a smooth bend:
    the ball touches both sides at once, at a distance of 2 r sin(t/2). A sharp corner is
    r (1 / cos(t/2) - 1) deeper than a ball of radius r. Of contacts with normals the distance
    tells r. Centres go into the corner and out of it, both against the turn; about a convex edge,
    whose contacts are those of one side or the other, they go along it.
    """
    pool = atlas.without_tip.pool
    if not pool.measured.any():
        return np.zeros((0, 3)), np.zeros(0)
    turn, gap = np.diff(pool.normals, axis=0), np.diff(pool.points, axis=0)
    chord = np.sqrt((turn * turn).sum(axis=1))
    # Twice the sine of half of the turn.
    found = (chord > 2.0 * np.sin(MOST_TILT)) & ((turn * gap).sum(axis=1) < 0.0)
    limit = atlas.levels.sure * np.hypot(atlas.sample_std, atlas.systematic_std)
    found &= ((gap + atlas.tip_radius * turn) * turn).sum(axis=1) <= limit * chord
    found &= (np.diff(pool.contours) == 0) & pool.measured[1:] & pool.measured[:-1]
    at = np.flatnonzero(found)
    radius = atlas.tip_radius or np.sqrt((gap[at] * gap[at]).sum(axis=1)) / chord[at]
    depth = radius * (1.0 / np.sqrt(np.maximum(1.0 - 0.25 * chord[at] ** 2, 0.01)) - 1.0)
    at, depth = at[depth > limit], depth[depth > limit]
    return 0.5 * (pool.points[at] + pool.points[at + 1]), depth


def _sharper_edges(atlas: AtlasState) -> list[Doubt]:
    """One doubt where convex edges of the centres are sharper than the tip is."""
    if not atlas.tip_radius or atlas.body is None:
        return []
    sure = atlas.levels.sure
    sharper = [
        edge
        for edge in atlas.body.faces.edges
        if edge.kind is EdgeKind.SHARP_CONVEX
        and edge.curves
        and edge.radius + sure * np.hypot(edge.radius_std, atlas.systematic_std) < atlas.tip_radius
    ]
    if not sharper:
        return []
    radius = float(np.median([edge.radius for edge in sharper]))
    words = (
        f"{count_of(len(sharper), 'edge of the centres is', 'edges of the centres are')} rounded "
        f"by {radius:.4g}, but a ball of radius {atlas.tip_radius:.4g} makes none so sharp; "
        "measure the tip."
    )
    points = np.array([edge.curves[0][len(edge.curves[0]) // 2] for edge in sharper])
    return [Doubt("tip radius", words, some_apart(points, box_diagonal(atlas.pool.points)))]


def _systematic(atlas: AtlasState) -> list[Doubt]:
    """One doubt where the error that all samples share leaves no surface known."""
    if SURE * atlas.systematic_std <= atlas.tolerance:
        return []
    words = (
        f"All samples may be off together by a deviation of {atlas.systematic_std:.3g}, so that no "
        "touch makes the surface known to the tolerance; qualify the probe."
    )
    return [Doubt("systematic error", words, NOWHERE)]
