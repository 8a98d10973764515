"""Gaps: what faces say of places that no patch knows, on a box with waves on its top."""

import numpy as np
import pytest

from tests.explored import spread_touches
from tests.lawful import lawful_object
from touchatlas.atlas import Atlas, load_atlas, save_atlas
from touchatlas.atlas.faces.known_law import KnownLaw
from touchatlas.atlas.known_surface import blend_of_patches, whole_field
from touchatlas.planner import Planner, load_planner, save_planner
from touchatlas.planner.place.places import Places
from touchatlas.sim import make_object

# Tolerances of the body, so that few touches know most of it.
COARSE = 3.0


@pytest.fixture(scope="module")
def wavy():
    """An atlas of 40 touches of which most samples obey laws, and a part does not."""
    body = lawful_object("wavy")
    atlas = Atlas(COARSE * body.tolerance, scale=body.tolerance)
    for touch in spread_touches(body, 40):
        atlas.add(touch)
    atlas.look_for_law()
    assert atlas.body is None and atlas.known_law.beside is not None
    return atlas


def without_faces(atlas: Atlas):
    """What the patches alone say of places of the body, and the places."""
    points, _ = lawful_object("wavy").sample(4000, np.random.default_rng(1))
    return points, blend_of_patches(atlas, points)


def test_faces_fill_what_no_patch_knows(wavy):
    """Their error is within the tolerance at 95 of 100 places, as 1.96 deviations promise."""
    points, patches = without_faces(wavy)
    both = wavy.blend(points)
    assert both.known[patches.known].all()
    filled = both.known & ~patches.known
    assert filled.sum() >= 10
    assert (np.abs(both.distance[filled]) <= wavy.tolerance).mean() >= 0.95
    assert (both.patch[filled] >= 0).all() and np.isfinite(both.deviation[filled]).all()
    assert np.allclose(np.linalg.norm(both.normal[filled], axis=1), 1.0, atol=1e-12)


def test_a_surface_without_faces_is_that_of_the_patches(wavy):
    ball = make_object("sphere")
    atlas = Atlas(ball.tolerance)
    for touch in spread_touches(ball, 12):
        atlas.add(touch)
    assert whole_field(atlas) is atlas.field
    points, patches = without_faces(wavy)
    law, wavy.known_law = wavy.known_law, KnownLaw()
    assert wavy.blend(points).distance.tobytes() == patches.distance.tobytes()
    wavy.known_law = law


def test_a_patch_of_both_sides_of_an_edge_covers_nothing(wavy):
    """Six samples of each of two faces that meet in a sharp edge make it a patch of both."""
    faces, gaps = wavy.known_law.surface.faces, whole_field(wavy).gaps
    sharp = {(edge.first, edge.second) for edge in faces.edges if edge.kind.sharp}
    both = []
    for row in wavy.table.rows.tolist():
        fitted = wavy.membership.fitted[row]
        of = faces.of[fitted[fitted < len(faces.of)]]
        some = [face for face in range(len(faces)) if (of == face).sum() >= 6]
        if any((a, b) in sharp for a in some for b in some):
            both.append(row)
    assert both
    assert not gaps.are_covered(np.array(both), wavy.table.origin[both]).any()


def test_a_foot_beyond_the_samples_of_a_patch_is_not_covered(wavy):
    """Nor is one that no patch owns."""
    table, gaps = wavy.table, whole_field(wavy).gaps
    row = table.rows[gaps.are_covered(table.rows, table.origin[table.rows])][:1]
    far = table.origin[row] + table.axes[row, 0] * 2.0 * table.radius[row]
    assert not gaps.are_covered(row, far).any()
    assert not gaps.are_covered(np.array([-1]), table.origin[row]).any()


def test_places_that_faces_know_are_not_open(wavy):
    """They count as known, with the deviation of the faces and the area of an open place."""
    law, opened, areas = wavy.known_law, [], []
    for known_law in (KnownLaw(), law):
        wavy.known_law = known_law
        places = Places()
        places.update(wavy, (), 0)
        opened.append(len(places.open(wavy.table.rows)[0]))
        areas.append(places.known(wavy.table.rows).area)
    assert opened[1] < opened[0]
    assert np.count_nonzero(areas[1]) - np.count_nonzero(areas[0]) == opened[0] - opened[1]


def test_places_are_computed_again_when_faces_are_read(wavy):
    """With no change of a patch: the same places as from scratch."""
    law, places, again = wavy.known_law, Places(), Places()
    wavy.known_law = KnownLaw()
    places.update(wavy, (), 0)
    wavy.known_law = law
    places.update(wavy, (), 0)
    again.update(wavy, (), 0)
    for one, other in zip(places.open(wavy.table.rows), again.open(wavy.table.rows), strict=True):
        assert one.tobytes() == other.tobytes()


def test_a_loaded_atlas_says_the_same(wavy, tmp_path):
    points, _ = without_faces(wavy)
    save_atlas(tmp_path / "wavy.npz", wavy)
    found, loaded = wavy.blend(points), load_atlas(tmp_path / "wavy.npz").blend(points)
    for name, column in vars(found).items():
        assert column.tobytes() == getattr(loaded, name).tobytes(), name


def test_a_planner_that_goes_by_filled_places_is_saved(wavy, tmp_path):
    planner = Planner(*lawful_object("wavy").start())
    forecast = planner.forecast(wavy)
    save_planner(tmp_path / "planner.json", planner, wavy)
    loaded = load_planner(tmp_path / "planner.json", wavy)
    assert loaded.forecast(wavy).predicted_coverage == forecast.predicted_coverage
