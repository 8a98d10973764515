"""Fewer sextics: how near they are to the surface that they follow, and how many."""

from functools import lru_cache

import numpy as np
import pytest

from touchatlas.atlas.surfaces.fewer import fewer_sextics
from touchatlas.atlas.surfaces.fit_free_form import fit_free_form

# Radii of a torus, the noise of its samples, and the largest radius of a sextic on it: it turns by
# a radian and a half. Points of it are about as far apart as given; the tolerance is five noises.
LARGE, SMALL, NOISE, RADIUS, SPACING, TOLERANCE = 30.0, 12.0, 0.02, 18.0, 1.7, 0.1
TOLERANCES = [0.03, TOLERANCE, 0.5, 3.0]


def torus(about, around) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) of a torus and its normals (n, 3)."""
    out = np.stack([np.cos(around), np.sin(around), np.zeros(len(around))], axis=1)
    normals = np.cos(about)[:, None] * out + np.sin(about)[:, None] * [0.0, 0.0, 1.0]
    return LARGE * out + SMALL * normals, normals


def at_random(count: int, seed: int):
    return torus(*np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, (2, count)))


def over_all():
    """Points (n, 3) of the torus about SPACING apart, and its normals there."""
    about = np.linspace(0.0, 2.0 * np.pi, 45)[:-1]
    around = np.linspace(0.0, 2.0 * np.pi, 120)[:-1]
    return torus(*(angle.ravel() for angle in np.meshgrid(about, around)))


def on_surface(surface, scale=1.0):
    """Points (n, 3) of a surface about SPACING apart, and its values (n, 5) beside them."""
    points = scale * over_all()[0]
    values = surface.values(points)
    return points - values[:, :1] * values[:, 1:4], values


def fewer(surface, tolerance=TOLERANCE, ends=None, scale=1.0):
    feet, values = on_surface(surface, scale)
    ends = np.zeros(len(feet), bool) if ends is None else ends
    on = feet, values[:, 1:4], np.sqrt(values[:, 4]), ends
    return fewer_sextics(surface, *on, len(feet), scale * SPACING, scale * tolerance)


@pytest.fixture(scope="module")
def fitted():
    points, normals = at_random(4000, 0)
    noise = NOISE * np.random.default_rng(1).normal(size=(4000, 1))
    return fit_free_form(points + noise * normals, normals, NOISE, RADIUS)


@pytest.fixture(scope="module")
def followed_to(fitted):
    """Fewer sextics to a tolerance, made once for each."""
    return lru_cache(lambda tolerance: fewer(fitted, tolerance))


@pytest.fixture(scope="module")
def followed(followed_to):
    return followed_to(TOLERANCE)


def test_a_torus_has_a_third_as_many_sextics_at_most(fitted, followed):
    """In the plane discs of 0.6 radii that cover all are 1.07 a square of a radius, in hexagons.
    Middles in turn, 0.4 radii apart, are 4.4 (random sequential adsorption, of a coverage of 0.55).
    """
    assert 3 * len(followed.sextics) <= len(fitted.sextics)


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_they_are_off_by_a_quarter_of_the_tolerance_at_most(fitted, followed_to, tolerance):
    """A mean of distances that are within a bound is. The bound holds at points 1.7 apart; between
    them sextics bend little, and the surface goes on to what samples show to its deviation."""
    points, followed = at_random(3000, 2)[0], followed_to(tolerance)
    values = fitted.values(points)
    off = followed.values(points)[:, 0] - values[:, 0]
    assert (np.abs(off) < 0.25 * tolerance + np.sqrt(values[:, 4])).all()
    cosine = (followed.values(points)[:, 1:4] * fitted.values(points)[:, 1:4]).sum(axis=1)
    # From one bound to the other over a quarter of the radius, and twice the noise of the surface.
    assert cosine.min() > np.cos((0.5 * tolerance + 2.0 * NOISE) / (0.25 * RADIUS))


def test_they_are_as_sure_as_the_surface(fitted, followed):
    """Their variance is that of the surface on average, with what they are off. Of errors nineteen
    in twenty are within 1.96 deviations."""
    points = at_random(3000, 4)[0]
    before, after = (one.values(points) for one in (fitted, followed))
    assert 0.7 < np.sqrt(np.mean(after[:, 4]) / np.mean(before[:, 4])) < 1.5
    assert (np.abs(after[:, 0]) < 1.96 * np.sqrt(after[:, 4])).mean() > 0.93


@pytest.mark.parametrize("tolerance", [TOLERANCE, 3.0])
def test_beside_the_surface_their_distances_hold(followed_to, tolerance):
    """Cubes of the spacing are drawn by these: their corners must be on the right side. Off the
    surface of a torus the distance is exact along its normals."""
    points, normals = at_random(2000, 5)
    followed = followed_to(tolerance)
    for level in (-SPACING, SPACING):
        found = followed.at(points + level * normals)
        assert np.abs(found[:, 0] - level).max() < 0.5 * SPACING
        assert ((found[:, 1:4] * normals).sum(axis=1) > 0.5).all()


def test_a_looser_tolerance_takes_no_more(followed_to):
    counts = [len(followed_to(tolerance).sextics) for tolerance in TOLERANCES]
    assert counts == sorted(counts, reverse=True) and counts[-1] < counts[0]


def test_where_the_surface_ends_its_own_sextics_stay(fitted):
    """They alone tell how unsure it is beyond."""
    points = on_surface(fitted)[0]
    ends = (np.abs(points[:, 0]) < SPACING) & (points[:, 1] > 0.0)
    found = fewer(fitted, ends=ends)
    assert len(found.sextics) < len(fitted.sextics)
    feet = points[ends]
    its, own = (one.sextics.origins[one.reaching(feet)] for one in (found, fitted))
    assert {tuple(middle) for middle in its.tolist()} <= {tuple(x) for x in own.tolist()}


def test_a_surface_that_no_fewer_sextics_follow_stays(fitted):
    points, normals = over_all()
    none = np.zeros(len(points), bool)
    crooked = normals[::-1]
    zero = np.zeros(len(points))
    on = points, crooked, zero, none, len(points)
    assert fewer_sextics(fitted, *on, SPACING, 1e-9) is fitted
