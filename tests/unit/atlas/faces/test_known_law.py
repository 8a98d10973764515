"""KnownLaw: when lawful faces are looked for, and what is found."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.lawful import touched_mesh
from touchatlas.atlas.faces import known_law
from touchatlas.atlas.faces.faces import Faces
from touchatlas.atlas.faces.known_law import KnownLaw, look_for_law
from touchatlas.atlas.samples.sample_pool import SamplePool

NOISE = 0.02
# An equal share of the variance is borne for lack of fit.
STD = np.sqrt(2.0) * NOISE
# Faces and a body that are not asked for anything.
SOME_FACES, SOME_BODY = object(), object()
# What faces say of a surface of which no part obeys a law.
_NONE = np.zeros(0, int)
LAWLESS = SimpleNamespace(faces=Faces((), (), np.zeros((0, 3)), _NONE, _NONE, _NONE, 1.0))


def pool_of(name: str, count: int) -> SamplePool:
    pool = SamplePool()
    pool.add(*touched_mesh(name, count, NOISE), False)
    return pool


@pytest.fixture(scope="module")
def box():
    return look_for_law(pool_of("box", 30), 2970, STD)


def first_due(law: KnownLaw) -> int:
    """The least number of samples with which one would look again."""
    return next(n for n in range(law.count + 1, 4 * law.count + 1) if law.is_due(n))


@pytest.mark.parametrize(
    ("law", "due"),
    [
        # Up to 5,000 samples each touch counts where laws hold or are likely.
        (KnownLaw(1000, 1.0, True, 0.8, SOME_FACES, None), 1001),
        (KnownLaw(1000, 1.0, True, 1.0, SOME_FACES, SOME_BODY), 1001),
        (KnownLaw(4900, 1.0, True, 1.0, SOME_FACES, SOME_BODY), 4901),
        # Beyond, they grow by a tenth.
        (KnownLaw(5000, 1.0, True, 1.0, SOME_FACES, SOME_BODY), 5500),
        (KnownLaw(20000, 1.0, True, 0.8, SOME_FACES, None), 22000),
        # Without edges nothing is read, and a quarter is soon asked.
        (KnownLaw(1000, 1.0), 1250),
        (KnownLaw(8000, 1.0), 10000),
        # Where much of the surface obeys no law, they grow by a half, and of many fourfold.
        (KnownLaw(1000, 1.0, True, 0.79), 1500),
        (KnownLaw(8000, 1.0, True, 0.5), 32000),
        # Faces that were read fill gaps, and are read again as samples grow by a half.
        (KnownLaw(8000, 1.0, True, 0.6, SOME_FACES, LAWLESS), 12000),
    ],
)
def test_the_next_look_is_due_by_growth(law, due):
    assert first_due(law) == due


def test_many_samples_of_which_few_obey_laws_are_not_looked_at():
    """Up to 5,000 samples they are; beyond only where more than two fifths obeyed laws."""
    assert KnownLaw(3000, 1.0, True, 0.3).is_due(4500)
    assert not any(KnownLaw(4000, 1.0, True, 0.39).is_due(n) for n in (6000, 16000, 10**6))
    assert KnownLaw(4000, 1.0, True, 0.41).is_due(16000)


def test_the_first_sample_is_looked_at_and_no_count_twice():
    assert KnownLaw().is_due(1) and not KnownLaw().is_due(0)
    assert not KnownLaw(1000, 1.0, True, 1.0, SOME_FACES, SOME_BODY).is_due(1000)
    assert not KnownLaw(1000, 1.0).is_due(1000)


def test_a_box_is_found(box):
    assert (box.count, box.std, box.edges) == (2970, STD, True)
    # The bound of a lawful body.
    assert box.share >= 0.96
    assert [face.kind for face in box.body.faces.faces] == ["plane"] * 6


def test_equal_samples_give_equal_faces_whatever_comes_after_them(box):
    pool = pool_of("box", 30)
    pool.add(*touched_mesh("box", 30, NOISE, seed=5), False)
    again = look_for_law(pool, 2970, STD)
    assert again.share == box.share
    assert again.body.faces.of.tobytes() == box.body.faces.of.tobytes()
    for one, other in zip(again.body.faces.faces, box.body.faces.faces, strict=True):
        assert one.words == other.words
        assert one.pieces[0].coefficients.tobytes() == other.pieces[0].coefficients.tobytes()


def test_a_smooth_body_is_never_read(monkeypatch):
    def read(samples):
        raise AssertionError("faces of a smooth body are read")

    monkeypatch.setattr(known_law, "faces_of_samples", read)
    pool = pool_of("ellipsoid", 30)
    law = look_for_law(pool, len(pool), STD)
    assert (law.count, law.std, law.edges, law.share, law.body) == (2970, STD, False, 0.0, None)


def test_ends_at_edges_are_edges():
    """All contours end at edges of which the probe tells: the faces are read, and one is none."""
    pool = SamplePool()
    points, outward, planes = touched_mesh("ellipsoid", 12, NOISE)
    ends = np.append((planes[1:] != planes[:-1]).any(axis=1), True)
    pool.add(points, outward, planes, ends)
    law = look_for_law(pool, len(pool), STD)
    assert law.edges
    assert law.share > 0.0


def test_labels_of_which_hardly_any_obey_a_law_are_not_revised(monkeypatch):
    """Of a box, if few contours ran over its edges; with less than a fifth the next look is due as
    where faces were read in vain."""

    def revise(labels):
        raise AssertionError("labels of a lawless body are revised")

    monkeypatch.setattr(known_law, "revise_all", revise)
    monkeypatch.setattr(known_law, "first_labels", lambda _: SimpleNamespace(lawful_share=0.19))
    monkeypatch.setattr(known_law, "share_over_sharp_edges", lambda _: 0.44)
    law = look_for_law(pool_of("box", 30), 2970, STD)
    assert (law.count, law.std, law.edges, law.share) == (2970, STD, True, 0.19)
    assert law.faces is law.body is None
    assert first_due(law) == 4455
