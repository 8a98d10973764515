"""All samples as one face: the law that explains every contour, or none."""

import numpy as np
import pytest

from tests.lawful import NOISE, samples_of_touches, touched, touched_mesh
from tests.lawful_meshes import HALF
from touchatlas.atlas.body.one_face import face_of_all, law_of_all
from touchatlas.sim import make_object


def touched_ball(count: int = 12, seed: int = 3, noise: float = NOISE):
    """Points, outward normals and planes (n, 3) of touches of a ball."""
    return touched(make_object("sphere"), count, noise, seed, 20.0, 16)


def kind_of(columns, std: float = NOISE) -> str:
    return face_of_all(samples_of_touches(columns, std)).faces[0].kind


def test_an_ellipsoid_is_one_quadric_of_its_extent():
    """Its ends, where no sample need lie, are within half of the noise."""
    faces = face_of_all(samples_of_touches(touched_mesh("ellipsoid", 30, NOISE), NOISE))
    assert [face.kind for face in faces.faces] == ["quadric"]
    ends = np.concatenate([np.diag(HALF), -np.diag(HALF)])
    distance, normal = faces.faces[0].pieces[0].at(ends)
    assert np.abs(distance).max() < 0.5 * NOISE
    assert (normal * ends).sum(axis=1) == pytest.approx(np.tile(HALF, 2), rel=1e-3)


def test_a_ring_is_one_torus_of_its_radii():
    """Of a part of it, too: six touches leave most of the tube without a sample."""
    obj = make_object("torus")
    faces = face_of_all(
        samples_of_touches(touched(obj, 6, NOISE, 3, 0.12 * obj.diagonal, 12), NOISE)
    )
    [law] = [face.law for face in faces.faces]
    assert law.kind == "torus"
    for name, true in (("radius", 40.0), ("tube_radius", 15.0)):
        assert abs(law.numbers[name] - true) < 5.0 * law.numbers[f"{name}_std"] < 0.5


@pytest.mark.parametrize("name", ["egg", "box", "step", "stadium"])
def test_a_body_without_one_law_is_free_form(name):
    assert kind_of(touched_mesh(name, 20, NOISE)) == "free-form"


@pytest.mark.parametrize("name", ["bottle", "mouse", "blob"])
def test_a_built_in_free_form_body_obeys_no_law(name):
    obj = make_object(name)
    columns = touched(obj, 6, NOISE, 3, 0.12 * obj.diagonal, 12)
    assert kind_of(columns) == "free-form"


def test_a_true_law_is_refused_as_often_as_the_test_says():
    """By chance one of 100 is: of 25 more than three are with a probability of 1e-4 (Poisson)."""
    refused = [kind_of(touched_ball(4, seed)) != "sphere" for seed in range(25)]
    assert sum(refused) <= 3


def test_one_contour_beside_a_ball_refuses_its_law():
    """Three deviations off, of 36 contours: all samples together would hardly tell."""
    points, outward, planes = touched_ball()
    samples = samples_of_touches((points, outward, planes), NOISE)
    one = samples.contours == 17
    moved = points + 3.0 * NOISE * one[:, None] * outward
    assert kind_of((points, outward, planes)) == "sphere"
    assert kind_of((moved, outward, planes)) == "free-form"


def test_few_samples_show_no_law():
    points, outward, planes = (column[:3] for column in touched_ball())
    assert law_of_all(samples_of_touches((points, outward, planes), NOISE)) is None
