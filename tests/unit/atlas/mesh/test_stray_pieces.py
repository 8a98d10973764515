"""Pieces that no sample supports, or that are small beside the surface, are left out."""

import numpy as np
import trimesh

from tests.meshes import surface_of
from touchatlas.atlas.mesh.mend import without_stray_pieces
from touchatlas.atlas.records.surface import Surface


def balls(*places_and_radii) -> Surface:
    """Balls of radii at places along x."""
    parts = []
    for place, radius in places_and_radii:
        ball = trimesh.creation.icosphere(subdivisions=2, radius=radius)
        ball.apply_translation([place, 0.0, 0.0])
        parts.append(ball)
    return surface_of(trimesh.util.concatenate(parts))


def pieces(surface: Surface) -> int:
    mesh = surface.to_trimesh()
    assert mesh.is_watertight
    return int(mesh.body_count)


ON_FIRST, ON_SECOND = [[0.0, 1.0, 0.0]], [[3.0, 1.0, 0.0]]


def test_a_piece_that_no_sample_supports_is_left_out_and_counted():
    """Though it is larger than half of the other."""
    two = balls((0.0, 1.0), (3.0, 0.6))
    found = without_stray_pieces(two, ON_FIRST)
    assert pieces(found) == 1 and found.stray_pieces == 1
    assert found.vertices[:, 0].max() <= 1.0 + 1e-9


def test_a_small_piece_is_left_out_though_samples_lie_beside_it():
    two = balls((0.0, 1.0), (3.0, 0.05))
    found = without_stray_pieces(two, [*ON_FIRST, *ON_SECOND])
    assert pieces(found) == 1 and found.stray_pieces == 1


def test_two_bodies_that_were_touched_stay():
    two = balls((0.0, 1.0), (3.0, 0.6))
    assert without_stray_pieces(two, [*ON_FIRST, *ON_SECOND]) is two


def test_a_single_piece_and_no_surface_stay_as_they_are():
    """The largest piece stays, wherever the samples are."""
    one = balls((0.0, 1.0))
    assert without_stray_pieces(one, ON_SECOND) is one
    nothing = one.only(np.zeros(len(one.vertices), bool))
    assert without_stray_pieces(nothing, ON_FIRST) is nothing


def test_a_small_piece_with_samples_stays_where_none_is_too_small():
    """As of a lawful body; one without a sample is removed there as well."""
    two = balls((0.0, 1.0), (3.0, 0.05))
    assert without_stray_pieces(two, [*ON_FIRST, *ON_SECOND], 0.0) is two
    assert without_stray_pieces(two, ON_FIRST, 0.0).stray_pieces == 1
