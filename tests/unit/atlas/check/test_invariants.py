"""Validation finds what it says it does: one number of each kind is corrupted, and is named."""

from copy import deepcopy
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.explored import bumpy, explored
from tests.flat import flat_touch
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas
from touchatlas.patch import ContourEnd


def touched(atlas) -> int:
    """The patch that owns the most samples."""
    return max(atlas.table.rows.tolist(), key=lambda row: len(atlas.membership.owned[row]))


@lru_cache
def sound(name: str):
    """An atlas with open outlines, a closed one, one with residuals, or one with edges; cells and
    outlines are computed, so that a change of them is not computed away."""
    atlas = _made(name)
    atlas.validate()
    return atlas


def _made(name: str):
    if name == "begun":
        return explored_sharp("block", max_touches=8).atlas
    if name == "edges":
        return explored_sharp("block", max_touches=30).atlas
    if name == "detailed":
        return bumpy().atlas
    if name == "lost":
        return lost()
    return explored("sphere").atlas


def lost() -> Atlas:
    """An atlas of one touch, all of whose contours lost contact."""
    atlas = Atlas(0.01)
    touch = flat_touch(np.zeros(3), *np.eye(3)[[2, 0]], 2e-3, np.random.default_rng(0))
    ends = (ContourEnd.LOST_CONTACT,) * 2
    atlas.add(replace(touch, contours=tuple(replace(c, ends=ends) for c in touch.contours)))
    return atlas


def column(name, change):
    def corrupt(atlas):
        values, row = getattr(atlas.table, name), touched(atlas)
        values[row] = change(values[row])

    return corrupt


def first(values, change):
    """The first of the numbers of an array changed by a fraction of itself, and some more."""
    values = np.array(values)
    values.flat[0] = change(values.flat[0])
    return values


def nudged(values):
    return first(values, lambda v: 1.001 * v + 1e-3)


def member(change):
    def corrupt(atlas):
        row = touched(atlas)
        atlas.membership.fitted[row] = change(atlas.membership.fitted[row].copy())

    return corrupt


def of(path, change):
    """Corrupts an array that is reached through attributes."""

    def corrupt(atlas):
        *way, last = path.split(".")
        for name in way:
            atlas = getattr(atlas, name)
        setattr(atlas, last, change(getattr(atlas, last).copy()))

    return corrupt


def residual_of(atlas):
    return atlas.table.residuals[min(atlas.table.residuals)]


def move_corner(atlas):
    cells = atlas.surface_graph.cells
    cells.corners[min(cells.corners)] += 0.5


def shift_corner(atlas):
    """By a millionth: still on the patches, and of about equal power."""
    cells = atlas.surface_graph.cells
    cells.corners[min(cells.corners)] += 1e-6


def drop_corner(atlas):
    cells = atlas.surface_graph.cells
    del cells.corners[min(cells.corners)]


def drop_boundary(atlas):
    cells = atlas.surface_graph.cells
    del cells.boundaries[max(cells.boundaries)]


def kept_outline(change):
    """Corrupts what is kept of the outline of a patch, after it was worked out."""

    def corrupt(atlas):
        outlines, row = atlas.surface_graph.outlines, touched(atlas)
        outlines.points([row])
        change(outlines, row)

    return corrupt


def move_outline(outlines, row):
    outlines._points[row] += 1e-3


def open_outline(outlines, row):
    outlines._open[row] = ~outlines._open[row]


def cover_frontier(atlas):
    atlas.frontier._depth[atlas.frontier.samples[0]] = 0.5


def one_sided_neighbour(atlas):
    row = touched(atlas)
    atlas.neighbours._sets[row].discard(min(atlas.neighbours[row]))


def stale_line(atlas):
    row = touched(atlas)
    atlas.neighbours.lines()[row, 0] = row


def own_twice(atlas):
    row, owned = touched(atlas), atlas.membership.owned
    owned[row] = np.append(owned[row], owned[row][:1])


def lose(atlas):
    row, owned = touched(atlas), atlas.membership.owned
    owned[row] = owned[row][1:]


CORRUPTIONS = {
    "alive": ("begun", column("alive", lambda v: 0.0), "removed"),
    "site": ("closed", column("site", nudged), "corner|boundary"),
    "origin": ("closed", column("origin", nudged), "equations"),
    "axes": ("closed", column("axes", nudged), "orthonormal"),
    "axes, turned": ("closed", column("axes", lambda v: v[[1, 2, 0]]), "equations"),
    "radius": ("closed", column("radius", nudged), "equations"),
    "weight": ("closed", column("weight", nudged), "corner|boundary"),
    "noise": ("closed", column("noise", nudged), "coefficients|equations|variance"),
    "measurement std": ("closed", column("measurement_std", lambda v: -v), "noise is negative"),
    "length ratio": ("closed", column("length_ratio", nudged), "equations|coefficients"),
    "z scale": ("closed", column("z_scale", lambda v: 1.5 * v), "coefficients"),
    "condition": ("closed", column("condition", lambda v: 0.5), "condition"),
    "moments": ("closed", column("moments", nudged), "moments"),
    "rhs": ("closed", column("rhs", nudged), "right side"),
    "sum of squares": ("closed", column("sum_of_squares", nudged), "square"),
    "count": ("closed", column("count", lambda v: v + 1), "counts"),
    "learned": ("closed", column("learned", lambda v: v + 1000), "framed"),
    "linearisation point": (
        "closed",
        column("linearisation_point", nudged),
        "equations|right side",
    ),
    "mean": ("closed", column("mean", nudged), "mean"),
    "variance": ("closed", column("variance", nudged), "variance"),
    "residual": ("closed", column("residual", nudged), "residual"),
    "outline": ("closed", kept_outline(move_outline), "outline is not where"),
    "outline, opened": ("closed", kept_outline(open_outline), "outline is open"),
    "outline, closed": ("begun", kept_outline(open_outline), "outline is open"),
    "not a number": ("closed", column("mean", lambda v: v * np.nan), "mean is not finite"),
    "index": ("closed", lambda a: a.table.index.move(touched(a), [0, 0, 0], 1.0), "index"),
    "index, removed": ("closed", lambda a: a.table.index.remove(touched(a)), "index"),
    "lengths": ("closed", of("table.lengths", nudged), "lengths"),
    "sample owned twice": ("closed", own_twice, "owned"),
    "sample lost": ("closed", lose, "owned"),
    "sample learned twice": ("closed", member(lambda m: np.append(m, m[0])), "twice"),
    "sample not learned": ("closed", member(lambda m: m[1:]), "counts"),
    "other sample learned": (
        "closed",
        member(lambda m: np.append(m[1:], m.max() + 1)),
        "equations",
    ),
    "no such sample": ("closed", member(lambda m: np.append(m[1:], 10**6)), "not there"),
    "neighbour of one only": ("closed", one_sided_neighbour, "mutual"),
    "neighbours' line": ("closed", stale_line, "line of patch"),
    "frontier": ("begun", cover_frontier, "frontier"),
    "edge end": ("edges", of("edge_ends.points", nudged), "no sample"),
    "edge end's tangent": ("edges", of("edge_ends.tangents", lambda v: v[:, ::-1]), "frame"),
    "edge end's normal": ("edges", of("edge_ends.normals", nudged), "frame"),
    "edge end's step": ("edges", of("edge_ends.steps", lambda v: -v), "step"),
    "edge end's home": ("edges", of("edge_ends.home", lambda v: v + 10**6), "removed"),
    "lost end": ("lost", of("rims.ends.points", lambda v: np.nan * v), "not finite"),
    "lost end's tangent": ("lost", of("rims.ends.tangents", lambda v: 2.0 * v), "unit length"),
    "lost end's normal": ("lost", of("rims.ends.normals", lambda v: np.nan * v), "unit length"),
    "lost end's step": ("lost", of("rims.ends.steps", lambda v: -v), "sampling step"),
    "corner": ("closed", move_corner, "corner"),
    "corner lost": ("closed", drop_corner, "corner"),
    "corner shifted": ("closed", shift_corner, "corners are not"),
    "boundary lost": ("closed", drop_boundary, "boundar"),
    "residual of none": (
        "detailed",
        lambda a: a.table.residuals.update({10**6: residual_of(a)}),
        "removed",
    ),
    "residual's samples": (
        "detailed",
        lambda a: nudge(residual_of(a).samples.height),
        "other samples",
    ),
    "residual's shape": ("detailed", lambda a: nudge(residual_of(a).shape), "does not follow"),
    "residual's force": (
        "detailed",
        lambda a: nudge(residual_of(a).residual.force),
        "does not follow",
    ),
    "residual's mean": ("detailed", lambda a: nudge(residual_of(a).mean), "mean"),
    "residual scale": (
        "detailed",
        lambda a: setattr(a, "residual_scale", type(a.residual_scale)()),
        "residuals but no",
    ),
}


def nudge(values):
    values.flat[0] = 1.001 * values.flat[0] + 1e-3


@pytest.mark.parametrize("kind", CORRUPTIONS)
def test_a_corrupted_number_is_found_and_named(kind):
    name, corrupt, words = CORRUPTIONS[kind]
    atlas = deepcopy(sound(name))
    corrupt(atlas)
    with pytest.raises(AssertionError, match=words):
        atlas.validate()


@pytest.mark.parametrize("name", ["begun", "edges", "closed", "detailed", "lost"])
def test_atlases_to_be_corrupted_are_sound_and_have_all_that_is_corrupted(name):
    atlas = sound(name)
    atlas.validate()
    detailed = len(atlas.table.residuals) > 0
    begun = len(atlas.frontier) > 0 and atlas.open_outlines().any()
    edges = len(atlas.edge_ends) > 0
    has = {"begun": begun, "edges": edges, "closed": atlas.closed, "detailed": detailed}
    has["lost"] = len(atlas.rims.ends) > 0
    assert has[name]
