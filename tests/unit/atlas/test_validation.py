"""Validation proves what it says: one number of each kind is corrupted, and is named."""

from copy import deepcopy
from functools import lru_cache

import numpy as np
import pytest

from tests.explored import explored
from tests.sharp import explored_sharp
from touchatlas.atlas.graph.creases import Crease

PATCH, SAMPLE = 5, 40


@lru_cache
def sound(name: str):
    """Half an exploration with open outlines, a closed one with residuals, or one with edges."""
    if name == "begun":
        return explored("torus", max_touches=25).atlas
    if name == "edges":
        return explored_sharp("cube", max_touches=40).atlas
    atlas = deepcopy(explored("torus").atlas)
    atlas.refit_all()
    atlas.learn_residuals()
    return atlas


def column(name, change):
    def corrupt(atlas):
        values = getattr(atlas.table, name)
        values[PATCH] = change(values[PATCH])

    return corrupt


def first(values, change):
    """The first of the numbers of an array changed by a share of itself, and some more."""
    values = np.array(values)
    values.flat[0] = change(values.flat[0])
    return values


def nudged(values):
    return first(values, lambda v: 1.001 * v + 1e-3)


def member(change):
    def corrupt(atlas):
        atlas.membership.fitted[PATCH] = change(atlas.membership.fitted[PATCH].copy())

    return corrupt


def of(path, change):
    """Corrupts an array that is reached through attributes."""

    def corrupt(atlas):
        *way, last = path.split(".")
        for name in way:
            atlas = getattr(atlas, name)
        setattr(atlas, last, change(getattr(atlas, last).copy()))

    return corrupt


def rough_of(atlas):
    return atlas.table.residuals[min(atlas.table.residuals)]


def crease_of(atlas, sign=1, shift=0.0):
    (i, j), crease = next(iter(atlas.creases.pairs.items()))
    atlas.creases.enter(i, j, Crease(sign * crease.sign, crease.anchor + shift))


def forget_crease(atlas):
    atlas.creases._partners[min(atlas.creases.pairs)[0]].clear()


def bend_curve(atlas):
    pair = next(p for p in sorted(atlas.creases.pairs) if len(atlas.creases.curve(*p)))
    atlas.creases._curves[pair] = atlas.creases.curve(*pair) + 0.1


def boundary_of(atlas):
    return atlas.cells.graph.edges[min(atlas.cells.graph.edges)]["boundary"]


def drop_edge(atlas):
    atlas.cells.graph.remove_edge(*min(atlas.cells.graph.edges))


def move_corner(atlas):
    atlas.cells.corners[min(atlas.cells.corners)] += 0.5


def drop_corner(atlas):
    atlas.cells._drop(min(atlas.cells.corners))


def forget_corner(atlas):
    atlas.cells._corners_of[min(atlas.cells.corners)[0]].clear()


def one_sided_kin(atlas):
    neighbours = sorted(atlas.neighbours[PATCH])
    atlas.neighbours[PATCH].discard(neighbours[0])


def stale_kin_line(atlas):
    atlas.neighbours.lines()[PATCH, 0] = PATCH


def bring_twice(atlas):
    atlas.membership.owned[PATCH] = np.append(atlas.membership.owned[PATCH], 0)


def lose(atlas):
    atlas.membership.owned[PATCH] = atlas.membership.owned[PATCH][1:]


CORRUPTIONS = {
    "alive": ("begun", column("alive", lambda v: 0.0), "removed"),
    "site": ("closed", column("site", nudged), "corner|boundary"),
    "origin": ("closed", column("origin", nudged), "equations"),
    "axes": ("closed", column("axes", nudged), "orthonormal"),
    "axes, turned": ("closed", column("axes", lambda v: v[[1, 2, 0]]), "equations"),
    "radius": ("closed", column("radius", nudged), "equations"),
    "power": ("closed", column("weight", nudged), "corner|boundary"),
    "noise": ("closed", column("noise", nudged), "coefficients|equations|variance"),
    "sensor": ("closed", column("measurement_std", lambda v: -v), "sensor"),
    "turn": ("closed", column("length_ratio", nudged), "equations|coefficients"),
    "bend": ("closed", column("z_scale", lambda v: 1.5 * v), "coefficients"),
    "condition": ("closed", column("condition", lambda v: 0.5), "condition"),
    "moments": ("closed", column("moments", nudged), "moments"),
    "right": ("closed", column("rhs", nudged), "right side"),
    "square": ("closed", column("sum_of_squares", nudged), "square"),
    "count": ("closed", column("count", lambda v: v + 1), "counts"),
    "learned": ("closed", column("learned", lambda v: v + 1000), "framed"),
    "anchor": ("closed", column("linearisation_point", nudged), "equations|right side"),
    "mean": ("closed", column("mean", nudged), "mean"),
    "variance": ("closed", column("variance", nudged), "variance"),
    "residual": ("closed", column("residual", nudged), "residual"),
    "ring": ("closed", column("outline", lambda v: first(v, lambda x: x + 9.0)), "ring"),
    "ring_open, opened": ("closed", column("outline_open", np.ones_like), "ring_open"),
    "ring_open, closed": ("begun", column("outline_open", np.zeros_like), "ring_open"),
    "not a number": ("closed", column("mean", lambda v: v * np.nan), "mean is not finite"),
    "index": ("closed", lambda a: a.table.index.move(PATCH, a.table.origin[PATCH], 1.0), "index"),
    "index, removed": ("closed", lambda a: a.table.index.remove(PATCH), "index"),
    "lengths": ("closed", of("table.lengths", nudged), "lengths"),
    "sample brought twice": ("closed", bring_twice, "brought"),
    "sample lost": ("closed", lose, "brought"),
    "sample learned twice": ("closed", member(lambda m: np.append(m, m[0])), "twice"),
    "sample not learned": ("closed", member(lambda m: m[1:]), "counts"),
    "other sample learned": (
        "closed",
        member(lambda m: np.append(m[1:], m.max() + 1)),
        "equations",
    ),
    "no such sample": ("closed", member(lambda m: np.append(m[1:], 10**6)), "not there"),
    "kin of one only": ("closed", one_sided_kin, "mutual"),
    "kin's line": ("closed", stale_kin_line, "lines of the kin"),
    "frontier point": ("begun", of("frontier.points", nudged), "no sample"),
    "frontier normal": ("begun", of("frontier.normals", nudged), "unit"),
    "frontier home": ("begun", of("frontier.home", lambda v: v + 10**6), "removed"),
    "frontier depth": ("begun", of("frontier.depth", lambda v: v + 9.0), "deeper"),
    "frontier depth, covered": ("begun", of("frontier.depth", lambda v: v - 9.0), "covered"),
    "edge end": ("edges", of("edge_ends.points", nudged), "no sample"),
    "edge end's tangent": ("edges", of("edge_ends.tangents", lambda v: v[:, ::-1]), "frame"),
    "edge end's normal": ("edges", of("edge_ends.normals", nudged), "frame"),
    "edge end's step": ("edges", of("edge_ends.steps", lambda v: -v), "step"),
    "edge end's home": ("edges", of("edge_ends.home", lambda v: v + 10**6), "removed"),
    "crease of one only": ("edges", forget_crease, "not mutual"),
    "crease's sign": ("edges", lambda a: crease_of(a, sign=-1), "wrong sign"),
    "crease's anchor": ("edges", lambda a: crease_of(a, shift=0.5), "anchor"),
    "crease's curve": ("edges", bend_curve, "curve"),
    "corner": ("closed", move_corner, "corner"),
    "corner lost": ("closed", drop_corner, "corner"),
    "corner unknown": ("closed", forget_corner, "corners"),
    "boundary lost": ("closed", drop_edge, "edges"),
    "boundary's points": ("closed", lambda a: boundary_of(a).points.__iadd__(0.1), "boundary"),
    "residual of none": (
        "closed",
        lambda a: a.table.residuals.update({10**6: rough_of(a)}),
        "removed",
    ),
    "residual's samples": ("closed", lambda a: nudge(rough_of(a).samples.height), "other samples"),
    "residual's shape": ("closed", lambda a: nudge(rough_of(a).shape), "does not follow"),
    "residual's force": ("closed", lambda a: nudge(rough_of(a).residual.force), "does not follow"),
    "residual's mean": ("closed", lambda a: nudge(rough_of(a).mean), "mean"),
    "texture": ("closed", lambda a: setattr(a, "texture", type(a.residual_scale)()), "texture"),
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


@pytest.mark.parametrize("name", ["begun", "edges", "closed"])
def test_atlases_to_be_corrupted_are_sound_and_have_all_that_is_corrupted(name):
    atlas = sound(name)
    atlas.validate()
    begun = len(atlas.frontier) > 0 and atlas.table.outline_open.any()
    edges = len(atlas.edge_ends) > 0 and len(atlas.creases) > 0
    closed = atlas.closed and len(atlas.table.residuals) > 0
    assert {"begun": begun, "edges": edges, "closed": closed}[name]
