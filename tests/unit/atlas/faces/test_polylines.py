"""Points of edges become curves in order, open or closed."""

import numpy as np

from touchatlas.atlas.faces.polylines import polylines


def test_shuffled_points_of_an_arc_are_put_in_order():
    rng = np.random.default_rng(0)
    angle = rng.permutation(np.linspace(0.0, np.pi, 60))
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    (line,) = polylines(points, np.zeros(60), 1e-3, 0.2)
    steps = np.diff(angle[line])
    assert len(line) == 60 and (np.all(steps > 0) or np.all(steps < 0))


def test_two_circles_are_two_closed_curves():
    angle = np.arange(50) / 50 * 2 * np.pi
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    points = np.concatenate([circle, circle + [0.0, 0.0, 1.0]])
    lines = polylines(points, np.zeros(100), 1e-3, 0.3)
    assert [len(line) for line in lines] == [51, 51]
    assert all(line[0] == line[-1] for line in lines)


def test_of_two_near_points_the_more_accurate_is_kept():
    points = np.array([[0.0, 0, 0], [0.01, 0, 0], [1.0, 0, 0]])
    (line,) = polylines(points, np.array([0.2, 0.1, 0.3]), 0.1, 2.0)
    assert sorted(line.tolist()) == [1, 2]
