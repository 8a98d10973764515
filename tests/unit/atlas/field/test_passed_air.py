"""Where a probe passed there is no body, whatever faces say."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from tests.explored import explored
from touchatlas.atlas import Touch, TouchStatus, extract_surface
from touchatlas.atlas.field.passed_air import PassedAir, air_inside, through_openings

RNG = np.random.default_rng(0)
# A body that is the half space below z = 0, and its deviation.
LITTLE = 0.01


def half_space(points):
    normal = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return points[:, 2], normal, np.full(len(points), LITTLE)


def test_a_body_with_air_is_the_difference_of_solids():
    """Within twice the radius of a ball the distance is the larger one of z and of the radius less
    the distance from the nearest middle, for balls of one radius; farther away nothing changes."""
    air = PassedAir(np.array([[0.0, 0.0, -2.0], [1.5, 0.0, -2.0]]), np.array([1.0, 1.0]))
    points = RNG.uniform([-4, -4, -6], [6, 4, 2], (4000, 3))
    found = air.moved(points, *half_space(points))
    away = np.linalg.norm(points[:, None] - air.middles, axis=2).min(axis=1)
    near = away < 2.0
    expected = np.where(near, np.maximum(points[:, 2], 1.0 - away), points[:, 2])
    assert found["distance"] == pytest.approx(expected, abs=1e-12)
    changed = near & (1.0 - away > points[:, 2])
    assert changed.any() and (found["deviation"] == np.where(changed, 1.0, LITTLE)).all()


def test_of_balls_of_two_sizes_that_counts_in_which_a_point_lies_deepest():
    air = PassedAir(np.array([[0.0, 0.0, -3.0], [0.0, 0.0, -1.5]]), np.array([2.0, 0.5]))
    point = np.array([[0.0, 0.0, -1.6]])
    assert air.moved(point, *half_space(point))["distance"] == pytest.approx([2.0 - 1.4])
    inside = np.array([[0.0, 0.0, -8.0]])
    assert air.moved(inside, *half_space(inside))["distance"].tolist() == [-8.0]


def test_the_normal_is_the_gradient_of_the_distance():
    """Central differences with a step of 1e-5 err by its square."""
    air = PassedAir(np.array([[0.0, 0.0, -2.0]]), np.array([1.0]))
    points, step = RNG.normal([0.0, 0.0, -2.0], 0.3, (200, 3)), 1e-5
    normal = air.moved(points, *half_space(points))["normal"]
    for k, along in enumerate(np.eye(3)):
        ahead, behind = (
            air.moved(points + side * step * along, *half_space(points))["distance"]
            for side in (1.0, -1.0)
        )
        assert normal[:, k] == pytest.approx((ahead - behind) / (2.0 * step), abs=1e-6)


def first(points):
    return points[:, 0]


def nowhere(points):
    return np.zeros(len(points), bool)


def everywhere(points):
    return np.ones(len(points), bool)


def air_of(*ends, reach: float = 10.0, std: float = 0.0, is_known=nowhere) -> PassedAir | None:
    """Of one way, beside the half space with one sample at the origin."""
    return air_inside(
        np.array([ends], float),
        lambda points: points[:, 2],
        lambda points: np.linalg.norm(points, axis=1),
        is_known,
        reach,
        std,
        4.0,
    )


def test_ways_outside_and_ways_to_the_surface_change_nothing():
    assert air_of([0, 0, 5], [0, 0, 0]) is None
    assert air_of([4, 0, 5], [4, 0, -0.5]) is None
    assert air_inside(np.zeros((0, 2, 3)), first, first, nowhere, 1.0, 0.0, 4.0) is None


def test_ways_through_an_opening_and_ways_from_inside_are_told_from_others():
    """A half space below z = 0 whose surface ends at x = 0. Down at x = 3, at x = -3, obliquely at
    x = 1; above it; and from below."""
    down = [[[3, 0, 5], [3, 0, -5]], [[-3, 0, 5], [-3, 0, -5]], [[-9, 0, 5], [11, 0, -5]]]
    others = [[[-3, 0, 5], [-3, 0, 1]], [[-3, 0, -5], [-3, 0, -1]]]
    found = through_openings(
        np.array([*down, *others], float),
        lambda points: (points[:, 2], np.tile([0.0, 0.0, 1.0], (len(points), 1))),
        lambda points, normals: points[:, 0] > 0.0,
    )
    assert found.tolist() == [True, False, True, False, True]


def test_where_a_way_runs_inside_there_are_balls_up_to_half_way_to_the_samples():
    air = air_of([4, 0, 5], [4, 0, -5])
    assert (air.middles[:, 2] < -0.2 * 4.0).all() and (air.middles[:, 0] == 4.0).all()
    assert air.radii == pytest.approx(0.5 * np.linalg.norm(air.middles, axis=1))
    # A sample on the way, as deep as noise, and where no face is believed.
    assert (air_of([0, 0, 31], [0, 0, -31]).radii > 0.0).all()
    below = np.zeros((1, 2, 3)), lambda points: -1.0 + 0.0 * first(points), first
    assert air_inside(*below, nowhere, 1, 0.0, 4.0) is None
    assert air_of([4, 0, 5], [4, 0, -5], std=2.0) is None
    assert air_of([40, 0, 5], [40, 0, -5]) is None


def test_below_a_known_surface_there_is_air_where_a_way_crosses_it_alone():
    """Down through it at x = 4: balls of half the distance to the sample that reach the crossing.
    Along it, 2 below, as in a bore behind a wall: none."""
    air = air_of([4, 0, 5], [4, 0, -9], is_known=everywhere)
    assert len(air.middles) and (air.radii >= -air.middles[:, 2]).all()
    assert len(air.middles) < len(air_of([4, 0, 5], [4, 0, -9]).middles)
    assert air_of([4, 0, -2], [-4, 0, -2], is_known=everywhere) is None
    assert air_of([4, 0, -2], [-4, 0, -2]) is not None


def in_vain(first, last) -> Touch:
    """An approach that met nothing from a first to a last point."""
    approach = (first - last) / np.linalg.norm(first - last)
    way = np.stack([first, last])
    middle = way.mean(axis=0)
    return Touch(99, middle, approach, (), TouchStatus.NO_CONTACT, 0.0, 1.0, way)


@pytest.mark.parametrize("name", ["bottle", pytest.param("cube", marks=pytest.mark.slow)])
def test_an_approach_in_vain_takes_surface_away_that_it_passed(name):
    """As if a probe had passed through the wall of a body of one free-form face, and of one of
    planes, as far from all samples as it is: there its inside is outside, by half of the distance
    from the samples, and nobody claims to know it. Elsewhere all is as it was. Without a way
    nothing is learned."""
    known = explored(name)
    atlas, body = deepcopy(known.atlas), known.atlas.body
    surface = extract_surface(known.atlas)
    at = int(body.away(surface.vertices).argmax())
    size, outward = float(body.away(surface.vertices)[at]), surface.normals[at]
    middle = (surface.vertices[at] - 0.3 * size * outward)[None]
    touch = in_vain(middle[0] + size * outward, middle[0] - size * outward)
    before = body.field.at(middle)
    assert before.distance[0] < 0.0
    atlas.add(replace(touch, way=None))
    assert atlas.body.field.at(middle).distance == before.distance
    change = atlas.add(touch)
    assert change.refused == "the probe reported: no contact"
    atlas.validate()
    after, clear = atlas.body.field.at(middle), body.away(middle)[0]
    # The nearest of 32 points of the way is this much away at most, and a ball there has a radius
    # that differs by half of that.
    off = size / 31
    assert after.distance[0] == pytest.approx(0.5 * clear, abs=1.5 * off)
    assert after.deviation[0] == pytest.approx(0.5 * clear, abs=0.5 * off)
    samples = atlas.pool.points[::50]
    one, other = body.field.at(samples), atlas.body.field.at(samples)
    assert (one.distance == other.distance).all() and (one.deviation == other.deviation).all()
