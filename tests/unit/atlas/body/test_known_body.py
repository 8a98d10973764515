"""KnownBody: when lawful faces are looked for, and what is found."""

import numpy as np
import pytest

from tests.lawful import touched_mesh
from touchatlas.atlas.body import known_body
from touchatlas.atlas.body.known_body import KnownBody, look_for_body
from touchatlas.atlas.body.read_faces import samples_of
from touchatlas.atlas.samples.sample_pool import SamplePool

NOISE = 0.02
# An equal share of the variance is borne for lack of fit.
STD = np.sqrt(2.0) * NOISE


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


def test_ends_at_edges_are_edges():
    """All contours end at edges of which the probe tells: the faces are read, and one is none."""
    pool = SamplePool()
    points, outward, planes = touched_mesh("ellipsoid", 12, NOISE)
    ends = np.append((planes[1:] != planes[:-1]).any(axis=1), True)
    pool.add(points, outward, planes, ends, NOISE)
    known = look_for_body(pool, STD)
    assert known.edges
    assert known.share > 0.0
