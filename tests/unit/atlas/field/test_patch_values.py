"""Values of single patches at points, and the groups that they are computed in."""

import numpy as np

from tests.explored import bumpy
from touchatlas.atlas.field.patch_values import groups


def test_padded_groups_hold_every_pair_and_no_other():
    rng = np.random.default_rng(0)
    rows = rng.choice([3, 70_000, 5, 9], p=[0.9, 0.06, 0.03, 0.01], size=3000)
    for some in (rows, rows[rows < 100], rows[:0]):
        found = []
        for patches, index in groups(some):
            assert (some[index] == patches[:, None]).all()
            found.append(np.unique(index))
        found = np.sort(np.concatenate(found)) if found else np.zeros(0, int)
        assert (found == np.arange(len(some))).all()


def test_normal_of_a_patch_with_a_residual_is_the_gradient_of_its_distance():
    """On the patch itself, where the distance of first order has the exact gradient: up to the
    step's square times the third derivative of the bumps, a f^3 = 0.06, and twice the distance
    times their curvature, 0.13."""
    ball, h = bumpy(), 1e-3
    field, table = ball.atlas.field, ball.atlas.table
    rows, which = table.index.near(ball.points)
    rough = np.isin(rows, list(table.residuals))
    rows, points = rows[rough], ball.points[which[rough]]
    for _ in range(4):
        distance, normals, _ = field.distances(rows, points)
        points = points - distance[:, None] * normals
    near = ((points - table.origin[rows]) ** 2).sum(axis=1) < (0.7 * table.radius[rows]) ** 2
    rows, points = rows[near], points[near]
    distance, normals, _ = field.distances(rows, points)
    sides = [
        field.distances(rows, points + h * e)[0] - field.distances(rows, points - h * e)[0]
        for e in np.eye(3)
    ]
    error = np.linalg.norm(np.stack(sides, axis=1) / (2.0 * h) - normals, axis=1)
    assert len(rows) > 500 and np.median(np.abs(distance)) < 1e-6
    assert np.quantile(error, 0.99) < 1e-4
