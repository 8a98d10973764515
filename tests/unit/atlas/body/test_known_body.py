"""KnownBody: when lawful faces are looked for, and what is found."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.lawful import touched_mesh
from touchatlas.atlas.body import known_body, one_face
from touchatlas.atlas.body.known_body import KnownBody, look_for_body
from touchatlas.atlas.body.read_faces import samples_of
from touchatlas.atlas.samples.sample_pool import SamplePool

NOISE = 0.02
# An equal share of the variance is borne for lack of fit.
STD = np.sqrt(2.0) * NOISE
# Faces that are not asked for anything.
SOME_FACES = object()


def pool_of(name: str, count: int) -> SamplePool:
    pool = SamplePool()
    pool.add(*touched_mesh(name, count, NOISE), False, NOISE)
    return pool


def looked(count: int, **more) -> KnownBody:
    """What was found when so many samples were looked at."""
    return KnownBody(count, count, 1.0, **more)


@pytest.fixture(scope="module")
def box():
    return look_for_body(pool_of("box", 30), STD)


def first_due(known: KnownBody) -> int:
    """The least number of samples with which one would look again."""
    return next(n for n in range(known.looked + 1, 4 * known.looked + 1) if known.is_due(n))


@pytest.mark.parametrize(
    ("known", "due"),
    [
        # Up to 5,000 samples each touch counts where laws hold or are likely.
        (looked(1000, edges=True, share=0.8, faces=SOME_FACES), 1001),
        (looked(4900, edges=True, share=1.0, faces=SOME_FACES), 4901),
        # Beyond, they grow by a tenth.
        (looked(5000, edges=True, share=1.0, faces=SOME_FACES), 5500),
        (looked(20000, edges=True, share=0.8, faces=SOME_FACES), 22000),
        # A body that is drawn from its faces learns from each touch: they know the new samples.
        (looked(20000, edges=True, share=1.0, faces=SOME_FACES, is_one=False), 20001),
        # Without edges nothing is read, and a quarter is soon asked.
        (looked(1000), 1250),
        (looked(8000), 10000),
        # Where much of the surface obeys no law, they grow by a half, and of many fourfold.
        (looked(1000, edges=True, share=0.79), 1500),
        (looked(8000, edges=True, share=0.5), 32000),
        # Of many of which most obey laws, by a half too.
        (looked(8000, edges=True, share=0.7), 12000),
    ],
)
def test_the_next_look_is_due_by_growth(known, due):
    assert first_due(known) == due


def test_many_samples_of_which_few_obey_laws_are_not_looked_at():
    """Up to 5,000 samples they are; beyond only where more than two fifths obeyed laws."""
    few = looked(4000, edges=True, share=0.39)
    assert looked(3000, edges=True, share=0.3).is_due(4500)
    assert not any(few.is_due(n) for n in (6000, 16000, 10**6))
    assert looked(4000, edges=True, share=0.41).is_due(16000)


def test_a_look_is_due_when_many_contours_have_come_to_turn_at_edges():
    """Once: the next one is due by growth."""
    turned = SimpleNamespace(faces=SimpleNamespace(is_sharp=True))
    smooth = SimpleNamespace(faces=SimpleNamespace(is_sharp=False))
    assert first_due(looked(1000, edges=True, share=0.3, body=turned)) == 1001
    assert first_due(looked(1000, edges=True, share=0.3, body=smooth)) == 1500
    assert first_due(looked(1000, edges=True, share=0.3, sharp=True, body=turned)) == 1500


def test_the_first_sample_is_looked_at_and_no_count_twice():
    assert KnownBody().is_due(1) and not KnownBody().is_due(0)
    assert not looked(1000, edges=True, share=1.0, faces=SOME_FACES).is_due(1000)
    assert not looked(1000).is_due(1000)


def test_a_box_is_found(box):
    assert (box.count, box.looked, box.std) == (2970, 2970, STD)
    assert (box.edges, box.is_one, box.is_hopeful) == (True, False, True)
    # The bound of a lawful body.
    assert box.share >= 0.96
    assert [face.kind for face in box.body.faces.faces] == ["plane"] * 6


def test_one_face_learns_each_touch_and_looks_are_due_by_growth(monkeypatch):
    """An egg: the body is of all samples at once, and laws are looked for when their number
    has grown by a quarter. The body is that of all samples, whatever was known before."""
    points, outward, planes = touched_mesh("egg", 12, NOISE)
    pool, known, looks = SamplePool(), KnownBody(), []
    for last in (1000, 1100, 1188):
        some = slice(len(pool), last)
        pool.add(points[some], outward[some], planes[some], False, NOISE)
        known = look_for_body(pool, STD, known)
        looks.append(known.looked)
        assert known.is_one and known.count == len(pool) == len(known.body.samples.points)
    assert len(points) == 1188 and looks == [1000, 1000, 1000]
    found = known.body.field.at(points)
    again = known_body.body_of_one(samples_of(pool, len(pool), STD)).field.at(points)
    assert np.array_equal(found.distance, again.distance)
    # A deviation of a sample is STD; the surface passes among all samples, the new ones too.
    assert np.sqrt(np.mean(found.distance[1000:] ** 2)) < 1.5 * STD


def test_a_look_for_laws_changes_nothing_of_a_body_without_edges():
    """It takes sextics from before the look, and the body is that of all samples to the last bit:
    a loaded atlas has none before."""
    points, outward, planes = touched_mesh("egg", 12, NOISE)
    pool, known, fits = SamplePool(), KnownBody(), []
    for last in (940, 1188):
        some = slice(len(pool), last)
        pool.add(points[some], outward[some], planes[some], False, NOISE)
        known = look_for_body(pool, STD, known)
        fits.append(known.body.field.trees.free_form(0).fits.kept)
        assert known.looked == last
    shared = fits[0].keys() & fits[1].keys()
    assert shared and all(fits[0][key] is fits[1][key] for key in shared)
    again = look_for_body(pool, STD).body.field.at(points)
    assert known.body.field.at(points).distance.tobytes() == again.distance.tobytes()


def test_without_a_new_sample_nothing_is_done(monkeypatch):
    def fit(samples):
        raise AssertionError("a body is fitted again")

    pool = pool_of("ellipsoid", 12)
    known = look_for_body(pool, STD)
    monkeypatch.setattr(known_body, "body_of_one", fit)
    assert look_for_body(pool, STD, known) is known
    assert look_for_body(pool, STD, known, last=True) is known
    assert look_for_body(SamplePool(), STD).body is None


def test_the_last_look_is_made_where_laws_may_be_found(box, monkeypatch):
    """At the end the faces of a box are read though no sample came; those of a body without edges
    are not."""
    looks: list[int] = []

    def look(samples, ends, before):
        looks.append(len(samples))
        return before

    monkeypatch.setattr(known_body, "_looked_for", look)
    pool = pool_of("box", 30)
    assert look_for_body(pool, STD, box) is box and not looks
    assert look_for_body(pool, STD, box, last=True) is box and looks == [2970]


def test_equal_samples_give_equal_faces(box):
    pool = pool_of("box", 30)
    again = look_for_body(pool, STD)
    assert again.share == box.share
    assert again.body.faces.of.tobytes() == box.body.faces.of.tobytes()
    for one, other in zip(again.body.faces.faces, box.body.faces.faces, strict=True):
        assert one.words == other.words
        assert one.pieces[0].coefficients.tobytes() == other.pieces[0].coefficients.tobytes()


def test_a_smooth_body_is_never_read(monkeypatch):
    def read(samples):
        raise AssertionError("faces of a smooth body are read")

    monkeypatch.setattr(known_body, "faces_of_samples", read)
    pool = pool_of("egg", 30)
    known = look_for_body(pool, STD)
    assert (known.count, known.looked, known.std) == (2970, 2970, STD)
    assert (known.edges, known.share, known.faces, known.is_one) == (False, 0.0, None, True)
    assert [face.kind for face in known.body.faces.faces] == ["free-form"]


def test_ends_at_edges_are_edges():
    """All contours end at edges of which the probe tells: the faces are read, and one is none."""
    pool = SamplePool()
    points, outward, planes = touched_mesh("ellipsoid", 12, NOISE)
    ends = np.append((planes[1:] != planes[:-1]).any(axis=1), True)
    pool.add(points, outward, planes, ends, NOISE)
    known = look_for_body(pool, STD)
    assert known.edges
    assert known.share > 0.0


@pytest.mark.parametrize(
    ("touches", "samples", "share", "is_revised"),
    [(12, 1188, 0.19, False), (12, 1188, 0.21, True), (30, 2970, 0.39, False)],
)
def test_labels_of_which_few_obey_a_law_are_not_revised(
    monkeypatch, touches, samples, share, is_revised
):
    """Of a box, if few contours ran over its edges; without revision the next look is due as where
    faces were read in vain."""

    class Revised(Exception):
        pass

    def revise(labels):
        raise Revised

    monkeypatch.setattr(known_body, "revise_all", revise)
    monkeypatch.setattr(known_body, "first_labels", lambda _: SimpleNamespace(lawful_share=share))
    monkeypatch.setattr(known_body, "share_over_sharp_edges", lambda _: 0.44)
    monkeypatch.setattr(one_face, "share_of_contours", lambda *_: 0.44)
    pool = pool_of("box", touches)
    if is_revised:
        with pytest.raises(Revised):
            look_for_body(pool, STD)
        return
    known = look_for_body(pool, STD)
    assert (known.count, known.looked, known.edges, known.share) == (samples, samples, True, share)
    assert known.faces is None and known.is_one
    assert first_due(known) == int(np.ceil(1.5 * samples))
