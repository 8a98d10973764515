"""Creases: sheets that meet at an edge, on bodies whose edges are known."""

from copy import deepcopy

import numpy as np
import pytest

from tests.explored import explored, touched_again
from tests.sharp import explored_sharp
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.graph.crease_curves import crease_curves, sources_of
from touchatlas.atlas.records.touch import Touch, TouchStatus
from touchatlas.atlas.store import load_atlas, save_atlas
from touchatlas.patch.geometry.contour import Contour, ContourEnd, SamplingPlane

NOISE = 0.02


def faces_of(atlas) -> dict[int, tuple[int, ...]]:
    """For each patch of an upright body the axis that its normal is nearest to."""
    return {i: tuple(np.rint(atlas.table.axes[i, 2]).astype(int).tolist()) for i in atlas.graph}


def test_exploration_goes_over_the_edges_of_a_cube():
    atlas = explored_sharp("cube").atlas
    axes = np.concatenate([np.eye(3), -np.eye(3)]).astype(int).tolist()
    assert set(faces_of(atlas).values()) == {tuple(axis) for axis in axes}
    assert not len(atlas.edge_ends)
    atlas.validate()


def test_edges_of_a_cube_are_convex_creases_between_faces_that_meet():
    atlas = explored_sharp("cube").atlas
    face = faces_of(atlas)
    joined = {tuple(sorted((face[i], face[j]))) for i, j in atlas.creases.pairs}
    assert len(joined) == 12
    for (i, j), crease in atlas.creases.pairs.items():
        assert crease.sign == 1 and not np.dot(face[i], face[j])
        # An anchor is where two fitted planes meet, within some five deviations of both.
        on_edge = np.abs(np.abs(crease.anchor) - 30.0) < 5 * NOISE
        assert on_edge.sum() >= 2


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_step_has_one_concave_edge(noise):
    atlas = explored_sharp("step", noise).atlas
    face = faces_of(atlas)
    concave = [pair for pair, crease in atlas.creases.pairs.items() if crease.sign == -1]
    assert concave
    for i, j in concave:
        assert {face[i], face[j]} == {(0, 0, 1), (1, 0, 0)}
        anchor = atlas.creases.pairs[i, j].anchor
        assert np.abs(anchor[[0, 2]]).max() < 5 * NOISE
    atlas.validate()


def test_blunt_ridge_is_a_crease_and_not_one_sheet():
    """Its normals differ by 50 degrees: less than those of sheet neighbours may."""
    atlas = explored_sharp("roof").atlas
    left, right = (
        {i for i in atlas.graph if atlas.table.axes[i, 2] @ n > 0.99}
        for n in np.array([[-0.4226, 0, 0.9063], [0.4226, 0, 0.9063]])
    )
    across = [(i, j) for i, j in atlas.creases.pairs if {i, j} & left and {i, j} & right]
    assert across and not any(atlas.neighbours[i] & right for i in left)
    off = [abs(atlas.creases.pairs[pair].anchor[0]) for pair in across]
    # Most patches know their plane there within a few of the noise, seen at 25 degrees.
    assert np.median(off) < 5 * NOISE / np.sin(np.deg2rad(25.0))


def test_faces_of_a_thin_wall_are_never_joined():
    atlas = explored_sharp("wall").atlas
    face = faces_of(atlas)
    for i, j in atlas.creases.pairs:
        assert np.dot(face[i], face[j]) == 0
    assert {(0, 0, 1), (0, 0, -1), (1, 0, 0)} <= set(face.values())


def test_fingers_are_never_joined_across_their_gap():
    atlas = explored_sharp("fingers", max_touches=120).atlas
    face = faces_of(atlas)
    for i, j in atlas.creases.pairs:
        assert np.dot(face[i], face[j]) == 0


@pytest.mark.parametrize("name", ["sphere", "torus", "bottle"])
def test_smooth_bodies_have_no_crease(name):
    atlas = explored(name).atlas
    assert not len(atlas.creases) and not len(atlas.edge_ends)


def test_domain_ends_at_the_crease():
    """No point of a face is beyond a crease; of its plane outside the face nearly all are that
    a patch reaches, but for edges that the patch itself hardly reaches."""
    atlas = explored_sharp("cube").atlas
    rng, outside = np.random.default_rng(0), []
    for row in [i for i, n in faces_of(atlas).items() if n == (0, 0, 1)]:
        near = rng.uniform(-1.0, 1.0, (400, 3)) * 15.0 + atlas.table.site[row]
        near[:, 2] = 30.0
        reach = np.abs(near[:, :2]).max(axis=1)
        beyond = atlas.surface_graph.visibility.beyond(np.full(len(near), row), near)
        assert not beyond[reach < 30.0 - 5 * NOISE].any()
        outside.append(beyond[reach > 30.0 + 5 * NOISE])
    assert np.concatenate(outside).mean() > 0.9


def test_curves_are_drawn_anew_where_a_patch_moved_and_nowhere_else():
    """What is kept equals, number by number, what is drawn from the patches as they are now."""
    atlas = deepcopy(explored_sharp("wall").atlas)
    curves, pairs = atlas.surface_graph.curves, sorted(atlas.creases.pairs)
    before = {pair: curves.curve(*pair) for pair in pairs}
    atlas.mark_stale(atlas.table.rows.tolist())
    assert all(curves.curve(*pair) is before[pair] for pair in pairs)
    for row in sorted({i for i, _ in pairs})[::5]:
        before = {pair: curves.curve(*pair) for pair in pairs}
        atlas.table.mean[row, 0] += 1e-3
        atlas.mark_stale([row])
        fresh = crease_curves(atlas.table, sources_of(atlas.table, atlas.creases, pairs))
        for pair, line in zip(pairs, fresh, strict=True):
            assert np.array_equal(curves.curve(*pair), line)
            assert row not in pair or curves.curve(*pair) is not before[pair]
        assert any(curves.curve(*pair) is before[pair] for pair in pairs)


def test_saved_creases_come_back(tmp_path):
    atlas = explored_sharp("step", max_touches=30).atlas
    save_atlas(tmp_path / "atlas.npz", atlas)
    again = load_atlas(tmp_path / "atlas.npz")
    assert set(again.creases.pairs) == set(atlas.creases.pairs)
    for name, column in vars(atlas.edge_ends).items():
        assert np.array_equal(vars(again.edge_ends)[name], column)
    assert np.array_equal(again.frontier.samples, atlas.frontier.samples)
    pool, saved = atlas.membership.pool, again.membership.pool
    for name in ("points", "normals", "across", "edges"):
        assert np.array_equal(getattr(pool, name), getattr(saved, name))
    assert pool.edges.any() and len(atlas.frontier) + len(atlas.edge_ends)
    save_atlas(tmp_path / "again.npz", again)
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "atlas.npz").read_bytes()


@pytest.mark.parametrize(("noise", "learns"), [(0.0, True), (1e-4, True), (0.02, False)])
def test_contours_within_their_noise_make_no_patch(noise, learns):
    """In the corner of a face two of three contours are 0.1 long: where they go no one can tell
    at a noise of 0.02, and the patch would lie askew."""
    ends, contours = (ContourEnd.EDGE, ContourEnd.LENGTH_REACHED), []
    for angle, length in ((0.0, 15.0), (1.0, 0.1), (2.1, 0.1)):
        along = np.array([np.cos(angle), np.sin(angle), 0.0])
        points = np.linspace(0.0, length, 9)[:, None] * along
        plane = SamplingPlane(np.zeros(3), np.cross(along, [0.0, 0.0, 1.0]))
        contours.append(Contour(points, plane, noise, ends))
    up, touched = np.array([0.0, 0.0, 1.0]), TouchStatus.TOUCHED
    atlas = Atlas(0.1)
    change = atlas.add(Touch(0, np.zeros(3), up, tuple(contours), touched, 15.2, 0.0))
    assert bool(change.added) == learns and bool(change.refused) != learns


@pytest.mark.parametrize("name", ["cube", "wall", "step"])
def test_graph_of_an_explored_body_is_a_sphere_but_for_its_gaps(name):
    """A gap is a hole: V - E + F is two less their number (Euler), before any merging."""
    atlas = explored_sharp(name).atlas
    assert atlas.euler_characteristic() + len(atlas.gaps) == 2
    atlas.validate()


def test_what_a_removed_face_had_closed_is_open_again():
    """A patch that is hidden takes its creases along: outlines that ended there are bare then."""
    whole = explored_sharp("step", max_touches=40, seed=2)
    for seed in range(3):
        atlas, rng = deepcopy(whole.atlas), np.random.default_rng(seed)
        for index in rng.permutation(40)[:6]:
            atlas.add(touched_again(whole.touches[index], rng))
            atlas.validate()
        atlas.simplify()
        atlas.validate()
