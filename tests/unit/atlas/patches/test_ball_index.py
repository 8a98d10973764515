"""The index of balls against a look at every ball, as balls come, move and go."""

import numpy as np
import pytest

from touchatlas.atlas.patches.ball_index import BallIndex


def by_looking_at_all(balls: dict, points) -> set:
    return {
        (row, i)
        for row, (centre, radius) in balls.items()
        for i in np.flatnonzero(((points - centre) ** 2).sum(axis=1) <= radius**2).tolist()
    }


def random_ball(rng, scale):
    return scale * rng.normal(size=3), scale * 0.1 * 2.0 ** rng.uniform(-5.0, 3.0)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e12])
@pytest.mark.parametrize("seed", range(3))
def test_pairs_are_those_of_all_balls_after_any_changes(scale, seed):
    rng = np.random.default_rng(seed)
    index, balls = BallIndex(), {}
    for _ in range(900):
        row = int(rng.integers(300))
        if row not in balls:
            balls[row] = random_ball(rng, scale)
            index.insert(row, *balls[row])
        elif rng.random() < 0.5:
            balls[row] = random_ball(rng, scale)
            index.move(row, *balls[row])
        else:
            index.remove(row)
            del balls[row]
        assert len(index) == len(balls) and (row in index) == (row in balls)
    points = scale * rng.normal(size=(400, 3))
    # So dense a line that points share their look-up.
    points = np.concatenate([points, scale * np.linspace([0, 0, 0], [0.1, 0.2, 0.0], 3000)])
    rows, which = index.near(points)
    pairs = list(zip(rows.tolist(), which.tolist(), strict=True))
    assert len(set(pairs)) == len(pairs)
    assert set(pairs) == by_looking_at_all(balls, points)
    assert (np.lexsort((rows, which)) == np.arange(len(rows))).all()
    for point, radius in zip(points[:60], scale * rng.uniform(0.0, 2.0, 60), strict=True):
        met = [r for r, (c, a) in balls.items() if ((c - point) ** 2).sum() < (a + radius) ** 2]
        assert index.rows_near(point, radius).tolist() == sorted(met)


def test_history_leaves_no_trace():
    """The same balls give the same pairs in the same order, however they came to be."""
    rng = np.random.default_rng(0)
    balls = [random_ball(rng, 1.0) for _ in range(200)]
    points = rng.normal(size=(100, 3))
    straight, winding = BallIndex(), BallIndex()
    for row, ball in enumerate(balls):
        straight.insert(row, *ball)
        winding.insert(199 - row, *random_ball(rng, 1.0))
    for row in rng.permutation(200).tolist():
        winding.move(row, *balls[row])
    for a, b in zip(straight.near(points), winding.near(points), strict=True):
        assert (a == b).all()


def test_far_points_are_far_from_a_tiny_ball():
    index = BallIndex()
    index.insert(0, [0.0, 0.0, 0.0], 1e-30)
    rows, which = index.near(np.array([[1e30, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    assert rows.tolist() == [0] and which.tolist() == [1]


def test_a_ball_that_changed_its_size_is_found_once():
    """Where it was, a tree of its old size still has it."""
    index, point = BallIndex(), np.zeros((1, 3))
    for row in range(100):
        index.insert(row, [row, 0.0, 0.0], 0.9)
    assert index.near(point)[0].tolist() == [0]
    for row in range(60):
        index.move(row, [0.0, 0.0, 0.01 * row], 8.0)
    for _ in range(2):
        assert index.near(point)[0].tolist() == list(range(60))


def test_nothing_is_near_an_empty_index():
    index = BallIndex()
    assert not len(index.near(np.zeros((3, 3)))[0]) and not len(index.rows_near(np.zeros(3), 1.0))


def test_balls_that_are_none_and_rows_entered_twice_are_refused():
    index = BallIndex()
    index.insert(3, np.zeros(3), 1.0)
    with pytest.raises(ValueError, match="not yet in the index"):
        index.insert(3, np.zeros(3), 1.0)
    for centre, radius in (([0, 0, np.nan], 1.0), ([0, 0, 0], 0.0), ([0, 0, 0], np.inf)):
        with pytest.raises(ValueError, match="radius > 0"):
            index.insert(4, centre, radius)
    with pytest.raises(KeyError, match="row 4"):
        index.remove(4)
