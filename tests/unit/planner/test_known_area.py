"""KnownArea: what is expected behind openings, and when an exploration stagnates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchatlas.planner.known import Areas, KnownArea
from touchatlas.planner.options import PlannerLevels

LEVELS = PlannerLevels()
# Least part of the surface that is worth a touch.
LEAST_SHARE = LEVELS.growth


def measured(areas, totals):
    known = KnownArea()
    for inside, total in zip(areas, totals, strict=True):
        known.measure(Areas(inside, inside, total, 0.0), again=False)
    return known


def test_behind_an_opening_of_which_nothing_was_found_yet_the_level_holds():
    known = measured([1.0], [2.0])
    assert known.behind(Areas(1.0, 1.0, 2.0, 0.5)) == pytest.approx(LEVELS.behind * 0.5)
    assert known.share(Areas(1.0, 1.0, 2.0, 0.5)) == pytest.approx(1.0 / (2.0 + LEVELS.behind / 2))


def test_what_is_left_of_openings_has_as_much_behind_it_as_what_was_found():
    """Nine of ten parts of the strips were entered, and 18 of area were found behind them: 2 a
    part. The part that is left has as much, and a tenth of the level for its own strip."""
    known = KnownArea()
    known.measure(Areas(1.0, 1.0, 2.0, 10.0), again=False)
    known.measure(Areas(1.0, 1.0, 20.0, 1.0), again=False)
    assert known.behind(Areas(1.0, 1.0, 20.0, 1.0)) == pytest.approx(1.8 + 0.1 * LEVELS.behind)


def test_nothing_is_behind_a_surface_without_openings():
    assert measured([1.0], [2.0]).behind(Areas(1.0, 1.0, 2.0, 0.0)) == 0.0


@given(st.floats(1e-3, 1e3), st.floats(0.0, 10.0), st.floats(0.0, 10.0))
def test_the_share_is_that_of_the_same_surface_in_another_unit(factor, unknown, found):
    def of(scale):
        known = KnownArea()
        first = scale * np.array([1.0, 1.0, 2.0, 5.0])
        last = scale * np.array([1.5, 1.5, 2.0 + found, unknown])
        known.measure(Areas(*first.tolist()), again=False)
        known.measure(Areas(*last.tolist()), again=False)
        return known.coverage

    # A few roundings of each of six products and sums.
    assert of(factor) == pytest.approx(of(1.0), rel=1e-14)


def test_what_does_not_grow_in_sixteen_touches_stagnates():
    assert not measured([1.0] * 16, [2.0] * 16).stagnates()
    assert measured([1.0] * 17, [2.0] * 17).stagnates()


def test_new_surface_is_growth_though_its_share_falls():
    areas = [1.0 + 0.01 * k for k in range(40)]
    assert not measured(areas, [1.0 + 0.05 * k for k in range(40)]).stagnates()


def test_a_growing_share_is_growth_though_cells_are_measured_smaller():
    """As on a lemon, whose cells shrank by a hundredth while its share went on growing."""
    shares = [0.5 + 0.01 * k for k in range(40)]
    totals = [1.0 - 0.05 * k / 40 if k > 10 else 2.0 for k in range(40)]
    areas = [share * total for share, total in zip(shares, totals, strict=True)]
    assert max(areas[24:]) < max(areas[:24])
    assert not measured(areas, totals).stagnates()


@pytest.mark.parametrize(("factor", "stagnates"), [(0.9, True), (1.1, False)])
def test_growth_is_the_least_share_a_touch(factor, stagnates):
    areas = [1.0] * 16 + [1.0 + factor * 16 * LEAST_SHARE] * 16
    assert measured(areas, [2.0] * 32).stagnates() is stagnates


def test_of_many_touches_a_quarter_may_pass_without_growth():
    areas = [float(k) for k in range(1, 101)]
    assert not measured([*areas, *[100.0] * 25], [200.0] * 125).stagnates()
    assert measured([*areas, *[100.0] * 35], [200.0] * 135).stagnates()


def test_a_measure_without_a_touch_between_changes_the_share_alone():
    known = KnownArea()
    for _ in range(40):
        known.measure(Areas(1.0, 1.0, 2.0, 0.0), again=bool(known.coverage))
    assert known.coverage == 0.5 and not known.stagnates()


@pytest.mark.parametrize(("left", "stagnates"), [(0.95, True), (0.85, False)])
def test_near_the_end_it_is_growth_when_a_tenth_of_what_is_missing_is_found(left, stagnates):
    """Of a hundredth that is missing a tenth is less than 16 least shares."""
    assert 16 * LEAST_SHARE > 0.1 * 0.01
    areas = [0.99] * 16 + [1.0 - 0.01 * left] * 16
    assert measured(areas, [1.0] * 32).stagnates() is stagnates


def test_a_ratio_that_rises_is_no_stagnation():
    """As at the rim of a vase: new surface is learned, but all of it counts for less."""
    known = KnownArea()
    for k in range(40):
        scale = 1.0 if k < 16 else 0.7
        area, total = 1.0 + 0.01 * k, 2.0 + 0.02 * k
        known.measure(Areas(scale * area, area, total, 0.0), again=False)
    assert not known.stagnates()


def test_what_is_known_whole_no_longer_grows():
    assert measured([1.0] * 17, [1.0] * 17).stagnates()
