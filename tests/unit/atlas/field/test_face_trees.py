"""FaceTrees: what is found for several faces at once is what each of them says."""

import numpy as np
import pytest

from tests.lawful import known_body
from touchatlas.atlas.field.face_trees import FaceTrees

# A box of six planes, a stadium whose rounds touch its planes, and a box with waves on its top.
BODIES = [("box", 40), ("stadium", 40), ("wavy", 40)]


@pytest.fixture(params=BODIES, ids=[name for name, _ in BODIES])
def trees(request):
    return known_body(*request.param).field.trees


@pytest.fixture
def points():
    return np.random.default_rng(0).uniform(-30.0, 30.0, (500, 3))


def test_distances_from_all_faces_are_those_from_each(trees, points):
    found = trees.all_distances(points)
    for face in trees.faces.faces:
        # Planes are found by their normals, and others by their gradients: 1e-9 is rounding.
        assert found[:, face.id] == pytest.approx(trees.distances(face.id, points), abs=1e-9)


def test_a_plane_that_is_a_part_of_a_free_form_surface_hides_no_distances(points):
    """The first face of such a surface may be one: the others have distances all the same."""
    faces = known_body("stadium", 40).faces
    kinds = [face.kind for face in faces.faces]
    group = kinds.index("plane"), kinds.index("cylinder")
    assert group[0] < group[1]
    trees = FaceTrees(faces)
    trees.__dict__["_group_of"] = dict.fromkeys(group, group)
    assert np.array_equal(
        trees.all_distances(points)[:, group[1]], trees.distances(group[1], points)
    )


def test_each_face_is_in_one_group(trees):
    together = [number for group in trees.groups for number in group]
    assert sorted(together) == list(range(len(trees.faces)))
    for number, group in enumerate(trees.groups):
        assert (trees.group_numbers[list(group)] == number).all()


def test_the_nearest_of_some_faces_has_the_nearest_sample(trees, points):
    some = tuple(range(0, len(trees.faces), 2))
    away = np.array([trees.away(number, points) for number in some])
    assert np.array_equal(trees.nearest_of(some, points), np.take(some, away.argmin(axis=0)))


def test_samples_beyond_a_limit_are_infinitely_far(trees, points):
    away, limited = trees.away(0, points), trees.away(0, points, 20.0)
    assert np.array_equal(limited, np.where(away < 20.0, away, np.inf))
    assert np.isinf(limited).any()
