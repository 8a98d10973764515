"""Beside a hole the surface ends where it is no longer known to the tolerance."""

from copy import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from tests.explored import explored
from touchatlas.atlas import extract_surface
from touchatlas.atlas.mesh.unsure_rims import without_unsure_rims


@pytest.fixture(scope="module")
def whole():
    atlas = explored("sphere").atlas
    return atlas, extract_surface(atlas)


def within(surface, direction, angle):
    """Whether vertices of a ball lie within an angle, in degrees, of a direction."""
    normals = surface.vertices / np.linalg.norm(surface.vertices, axis=1)[:, None]
    return normals @ np.asarray(direction, float) > np.cos(np.deg2rad(angle))


def as_sure_as(atlas, surface):
    """The atlas, whose patches are as sure as the vertices of a surface."""
    other = copy(atlas)

    def at(points):
        same = cKDTree(surface.vertices).query(points)[1]
        return SimpleNamespace(deviation=surface.deviation[same])

    other.field = SimpleNamespace(at=at)
    return other


def test_coarse_triangles_beside_a_hole_stay(whole):
    """The sagitta of triangles of 8 mm on a ball of 33 mm is 0.2 mm, two tolerances."""
    atlas, _ = whole
    coarse = extract_surface(atlas, edge=8.0)
    assert (coarse.deviation > atlas.tolerance).any()
    holed = coarse.only(~within(coarse, [0, 0, 1], 20))
    assert len(without_unsure_rims(atlas, holed).faces) == len(holed.faces)


def test_a_guess_that_reaches_into_a_hole_is_left_out_and_one_amid_the_surface_stays(whole):
    atlas, surface = whole
    guess, beside = within(surface, [0, 0, 1], 30), within(surface, [1, 0, 0], 20)
    deviation = np.where(guess | beside, 1.1 * atlas.tolerance, surface.deviation)
    holed = replace(surface, deviation=deviation).only(~within(surface, [0, 0, 1], 10))
    left = without_unsure_rims(as_sure_as(atlas, holed), holed)
    assert not within(left, [0, 0, 1], 29.9).any()
    assert within(left, [1, 0, 0], 20).sum() == beside.sum()
    # A ball without a cap.
    mesh = trimesh.Trimesh(left.vertices, left.faces, process=False)
    assert mesh.euler_number == 1 and mesh.body_count == 1


def test_a_closed_surface_and_one_with_a_sure_rim_are_left_as_they_are(whole):
    atlas, surface = whole
    unsure = replace(surface, deviation=np.full(len(surface.deviation), 2.0 * atlas.tolerance))
    assert without_unsure_rims(atlas, unsure) is unsure
    holed = surface.only(~within(surface, [0, 0, 1], 10))
    assert without_unsure_rims(atlas, holed) is holed
