"""KnownBody: when one face and many are compared, and which describes the samples shorter."""

from dataclasses import replace

import numpy as np
import pytest

from tests.lawful import touched_mesh
from touchatlas.atlas.body import choose
from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.choose import (
    KnownBody,
    body_of_faces,
    body_of_one,
    body_of_parts,
    description_length,
    look_for_body,
)
from touchatlas.atlas.body.read_faces import faces_of_samples, samples_of
from touchatlas.atlas.labels.samples import contour_samples
from touchatlas.atlas.samples.sample_pool import SamplePool

NOISE = 0.02
# An equal share of the variance is lack of fit.
STD = np.sqrt(2.0) * NOISE


def pool_of(name: str, count: int, ends=False) -> SamplePool:
    pool = SamplePool()
    pool.add(*touched_mesh(name, count, NOISE), ends, NOISE)
    return pool


@pytest.fixture(scope="module")
def box():
    return look_for_body(pool_of("box", 22), STD)


def test_a_plane_is_described_by_its_misfit_and_three_parameters():
    """Of n samples with white noise the misfit is half of a chi-square of n - 3 degrees of freedom,
    and three parameters take 3/2 log n nats; within 4 deviations, sqrt(n / 2) each."""
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.linspace(-20.0, 20.0, 40), np.linspace(-20.0, 20.0, 10))
    points = np.column_stack([x.ravel(), y.ravel(), STD * rng.normal(size=x.size)])
    outward, planes = np.tile([0.0, 0.0, 1.0], (400, 1)), np.tile([0.0, 1.0, 0.0], (400, 1))
    planes[(np.arange(400) // 40) % 2 == 1] *= -1.0
    samples = contour_samples(points, outward, planes, STD)
    body = Body(faces_of_samples(samples), samples)
    assert body.faces.faces[0].kind == "plane"
    expected = 0.5 * (400 - 3) + 1.5 * np.log(400)
    assert description_length(body) == pytest.approx(expected, abs=4.0 * np.sqrt(200.0))


def test_six_planes_describe_a_box_shorter_than_one_free_form_face(box):
    assert (box.count, box.looked, box.std) == (2178, 2178, STD)
    assert not box.is_one_face
    assert [face.kind for face in box.body.faces.faces] == ["plane"] * 6
    one = description_length(body_of_one(box.body.samples))
    assert description_length(box.body) < 0.5 * one


@pytest.mark.parametrize("free", [0, 1, 3, 5, 6])
def test_a_body_of_faces_has_laws_of_most_samples(box, free):
    """The smallest sides obey no law: of a box whose other sides have more than half of the samples
    there is a body."""
    order = sorted(box.body.faces.faces, key=lambda face: len(face.samples))
    lawless = {face.id for face in order[:free]}
    some = [replace(one, law=None) if one.id in lawless else one for one in box.body.faces.faces]
    lawful = sum(len(face.samples) for face in order[free:])
    found = body_of_faces(replace(box.body.faces, faces=tuple(some)), box.body.samples)
    assert (found is not None) == (lawful > 0.5 * len(box.body.samples)) == (free < 5)


def test_lengths_of_boxes_far_apart_add_up():
    """A parameter costs what the samples of its own piece make it cost, however many others there
    are: two equal boxes take twice the nats of one, to rounding."""
    points, outward, planes = touched_mesh("box", 20, NOISE)
    away = np.array([500.0, 0.0, 0.0])
    lengths = []
    for shifts in ([0.0], [0.0, 1.0]):
        places = np.concatenate([points + shift * away for shift in shifts])
        columns = [np.tile(column, (len(shifts), 1)) for column in (outward, planes)]
        samples = contour_samples(places, *columns, STD)
        body = Body(faces_of_samples(samples), samples)
        assert [face.kind for face in body.faces.faces] == ["plane"] * 6 * len(shifts)
        lengths.append(description_length(body))
    assert lengths[1] == pytest.approx(2.0 * lengths[0], rel=1e-6)


def test_faces_that_two_parts_know_apart_are_joined(box):
    """Each half of the touches knows the six planes: twelve pieces become six again."""
    faces, half = box.faces, box.body.samples.touches > 10
    first = np.count_nonzero(~half)
    of = [faces.patch_of[:first], faces.patch_of[first:]]
    assert not half[:first].any() and all(len(np.unique(some)) >= 6 for some in of)
    known = body_of_parts(box.body.samples, [(faces.pieces, some, False) for some in of])
    assert known.body.faces.are_lawful and len(known.body.faces) == 6
    assert len(known.body.faces.edges) == len(box.body.faces.edges)


def test_samples_beside_the_faces_make_their_description_longer(box):
    """One side is moved by ten deviations at every fourth sample: each of them takes the price of
    an unexplained sample instead of half a nat."""
    samples, side = box.body.samples, box.body.faces.faces[1]
    moved = side.samples[::4]
    points = samples.points.copy()
    points[moved] += 10.0 * STD * side.pieces[0].axes[2]
    columns = points, samples.outward, samples.planes, STD
    longer = body_of_faces(box.faces, contour_samples(*columns))
    more = description_length(longer) - description_length(box.body)
    assert more > 5.0 * len(moved)


def test_one_face_learns_each_touch_and_is_compared_by_growth():
    """An egg: the body is that of all samples, whatever was known of the first of them."""
    points, outward, planes = touched_mesh("egg", 12, NOISE)
    pool, known, looks = SamplePool(), KnownBody(), []
    for last in (1020, 1030, 1188):
        some = slice(len(pool), last)
        pool.add(points[some], outward[some], planes[some], False, NOISE)
        known = look_for_body(pool, STD, known)
        looks.append(known.looked)
        assert known.is_one_face and known.count == len(pool)
    # Powers of 1.25 are 1009.7 and 1262.2.
    assert looks == [1020, 1020, 1020]
    found = known.body.field.at(points)
    again = body_of_one(samples_of(pool, len(pool), STD)).field.at(points)
    assert np.array_equal(found.distance, again.distance)
    # A deviation of a sample is STD; the surface passes among all samples, the new ones too.
    assert np.sqrt(np.mean(found.distance[1020:] ** 2)) < 1.5 * STD


def test_faces_learn_each_touch(box):
    """Between two comparisons as well: the faces are those that a reading of all samples gives."""
    points, outward, planes = touched_mesh("box", 22, NOISE)
    pool, known = SamplePool(), KnownBody()
    for last in (2079, 2178):
        some = slice(len(pool), last)
        pool.add(points[some], outward[some], planes[some], False, NOISE)
        known = look_for_body(pool, STD, known)
    assert (known.count, known.looked) == (2178, 2079)
    assert len(known.body.faces.of) == 2178
    assert [face.words for face in known.body.faces.faces] == [
        face.words for face in box.body.faces.faces
    ]


def test_without_a_new_sample_nothing_is_done(monkeypatch):
    def fit(samples):
        raise AssertionError("a body is fitted again")

    pool = pool_of("ellipsoid", 12)
    known = look_for_body(pool, STD)
    monkeypatch.setattr(choose, "body_of_one", fit)
    assert look_for_body(pool, STD, known) is known
    assert look_for_body(pool, STD, known, last=True) is known
    assert look_for_body(SamplePool(), STD).body is None


def test_equal_samples_give_equal_faces(box):
    again = look_for_body(pool_of("box", 22), STD)
    assert again.body.faces.of.tobytes() == box.body.faces.of.tobytes()
    for one, other in zip(again.body.faces.faces, box.body.faces.faces, strict=True):
        assert one.words == other.words
        assert one.pieces[0].coefficients.tobytes() == other.pieces[0].coefficients.tobytes()


def test_faces_of_a_smooth_body_are_never_read(monkeypatch):
    def read(samples, *, before=None):
        raise AssertionError("faces of a smooth body are read")

    monkeypatch.setattr(choose, "faces_of_samples", read)
    known = look_for_body(pool_of("egg", 15), STD)
    assert known.faces is None
    assert [face.kind for face in known.body.faces.faces] == ["free-form"]


def test_ends_at_edges_are_edges():
    """All contours of a smooth body end at edges, as a probe says: its faces are read."""
    planes = touched_mesh("ellipsoid", 12, NOISE)[2]
    pool = pool_of("ellipsoid", 12, np.append((planes[1:] != planes[:-1]).any(axis=1), True))
    samples = samples_of(pool, len(pool), STD)
    none = np.zeros(len(pool), bool)
    assert choose.shares_at_edges(samples, pool.edges, none) == (1.0, 1.0)
    assert choose.shares_at_edges(samples, none, none) == (0.0, 0.0)
    assert len(faces_of_samples(samples)) >= 1


def test_laws_that_leave_noise_alone_are_compared_with_nothing(box, monkeypatch):
    """No other description is shorter: neither of one face, nor of faces that are read anew."""
    samples = box.body.samples
    assert choose.leaves_noise(box.body)
    others = body_of_one(samples), body_of_faces(faces_of_samples(samples), samples)
    assert description_length(box.body) <= min(map(description_length, others))

    def read(*_):
        raise AssertionError("another description is sought")

    monkeypatch.setattr(choose, "body_of_one", read)
    monkeypatch.setattr(choose, "first_labels", read)
    again = look_for_body(pool_of("box", 22), STD, replace(box, looked=1000))
    assert (again.count, again.looked) == (2178, 2178)
    assert again.body.faces.of.tobytes() == box.body.faces.of.tobytes()


def test_one_contour_that_laws_do_not_explain_is_more_than_noise(box):
    """A contour of 33 samples on a side, moved by two deviations: four squares instead of one."""
    samples, side = box.body.samples, box.body.faces.faces[1]
    counts = np.bincount(samples.contours[side.samples])
    moved = side.samples[samples.contours[side.samples] == counts.argmax()]
    points = samples.points.copy()
    points[moved] += 2.0 * STD * side.pieces[0].axes[2]
    columns = points, samples.outward, samples.planes, STD
    assert not choose.leaves_noise(body_of_faces(box.faces, contour_samples(*columns)))
