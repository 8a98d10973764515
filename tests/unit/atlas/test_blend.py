"""The blend against its definition patch by patch, and against its own finite differences."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import explored
from touchatlas.atlas.field.patch_values import COVER_MARGIN, groups
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN
from touchatlas.atlas.graph.sheets import SheetNeighbours, same_sheet


@pytest.fixture(scope="module")
def torus():
    return explored("torus").atlas


def near_the_surface(atlas, rng, count, share):
    """Points (n, 3) up to ``share`` of a radius from the surface, and some far from it."""
    rows = rng.choice(atlas.table.rows, size=count)
    spread = share * rng.uniform(-1.0, 1.0, (count, 3)) * atlas.table.radius[rows, None]
    return atlas.table.origin[rows] + spread


def powers(atlas, rows, point):
    return ((point - atlas.table.site[rows]) ** 2).sum(axis=1) - atlas.table.weight[rows]


def blend_by_definition(atlas, point):
    """Distance, normal, deviation and leader at a point, a patch at a time."""
    found, own = {}, {}
    for i in sorted(atlas.graph):
        patch = atlas.patch(i)
        local = patch.frame.to_local(point[None])[0] / patch.radius
        distance = patch.signed_distance(point[None])[0]
        if local @ local > 1.0 or abs(distance) > 0.5 * patch.radius:
            continue
        normal, deviation = patch.normal(point[None])[0], patch.deviation(point[None])[0]
        # What the degree leaves out is in the deviation, but weighs on no patch's say.
        alone = replace(patch, leftover=0.0).deviation(point[None])[0]
        found[i] = (distance, normal, deviation**2, (1.0 - local @ local) ** 3 / alone**2)
        foot, size = point - distance * normal, atlas.table.weight[i]
        here, rivals = powers(atlas, [i], foot)[0], powers(atlas, sorted(atlas.neighbours[i]), foot)
        if here <= COVER_MARGIN * size and here <= rivals.min() + CELL_MARGIN * size:
            own[i] = abs(distance)
    if not own:
        return None
    owner = min(own, key=own.__getitem__)
    patch_values = [found[i] for i in found if i == owner or i in atlas.neighbours[owner]]
    weights = np.array([w for *_, w in patch_values]) / sum(w for *_, w in patch_values)
    distance, normal, variance = (
        sum(w * v[n] for w, v in zip(weights, patch_values, strict=True)) for n in range(3)
    )
    return distance, normal / np.linalg.norm(normal), np.sqrt(variance), owner


def test_blend_is_its_definition_patch_by_patch(torus):
    points = near_the_surface(torus, np.random.default_rng(0), 60, 0.6)
    seen, known = torus.blend(points), 0
    for i, point in enumerate(points):
        one = blend_by_definition(torus, point)
        assert seen.known[i] == (one is not None)
        if one is not None:
            known += 1
            # The same sums in another order.
            assert seen.distance[i] == pytest.approx(one[0], rel=1e-9, abs=1e-12)
            assert seen.normal[i] == pytest.approx(one[1], abs=1e-9)
            assert seen.deviation[i] == pytest.approx(one[2], rel=1e-9)
            assert seen.patch[i] == one[3]
    assert 20 < known < 60


def test_a_point_is_seen_alone_as_among_many(torus):
    """Points that share look-ups and groups of patches do not see each other."""
    points = near_the_surface(torus, np.random.default_rng(1), 20_000, 0.1)
    together, few = torus.blend(points), np.arange(0, 20_000, 397)
    alone = torus.blend(points[few])
    assert (together.patch[few] == alone.patch).all()
    assert together.distance[few] == pytest.approx(alone.distance, abs=1e-12, nan_ok=True)


def test_gradient_of_the_distance_is_the_normal():
    """On the surface the two differ by how fast the say of patches that disagree changes: their
    gaps, a noise or so, times some 4 over the patch radius. Off it the distance is of first
    order, and its gradient errs by twice the distance times the curvature."""
    atlas, h, ball = explored("sphere").atlas, 1e-4, 33.0
    points = np.random.default_rng(0).normal(size=(300, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    disagreement = 4.0 * atlas.table.noise.max() / atlas.table.radius.min()
    for off in (-0.3, -0.05, 0.0, 0.05, 0.3):
        at = points * (ball + off)
        sides = [
            atlas.blend(at + h * e).distance - atlas.blend(at - h * e).distance for e in np.eye(3)
        ]
        error = np.stack(sides, axis=1) / (2.0 * h) - atlas.blend(at).normal
        limit = disagreement + 2.0 * abs(off) / ball
        assert np.linalg.norm(error, axis=1).max() < limit


def test_points_that_are_none_are_refused(torus):
    for points in (np.full((1, 3), np.nan), np.zeros(3), np.zeros((2, 2))):
        with pytest.raises(ValueError, match="points"):
            torus.blend(points)
    assert len(torus.blend(np.zeros((0, 3))).distance) == 0


def test_padded_groups_hold_every_pair_and_no_other():
    rng = np.random.default_rng(0)
    rows = rng.choice([3, 70_000, 5, 9], p=[0.9, 0.06, 0.03, 0.01], size=3000)
    for some in (rows, rows[rows < 100], rows[:0]):
        met = []
        for patches, index in groups(some):
            assert (some[index] == patches[:, None]).all()
            met.append(np.unique(index))
        met = np.sort(np.concatenate(met)) if met else np.zeros(0, int)
        assert (met == np.arange(len(some))).all()


def test_lines_of_neighbours_follow_the_sets():
    """Joined, separated and isolated at random, the padded array says the same as the sets."""
    rng, neighbours = np.random.default_rng(0), SheetNeighbours()
    for row in range(40):
        neighbours.append(i for i in range(row) if rng.random() < 0.3)
        one, other = rng.integers(0, row + 1, 2).tolist()
        if one != other:
            (neighbours.join if rng.random() < 0.5 else neighbours.separate)(one, other)
        if rng.random() < 0.1:
            neighbours.isolate(one)
        for i, line in enumerate(neighbours.lines().tolist()):
            assert set(line) - {i} == neighbours[i]
            assert all(i in neighbours[j] for j in neighbours[i])
    first, second = rng.integers(0, 40, (2, 300))
    expected = [
        i in neighbours[j] or i == j for i, j in zip(first.tolist(), second.tolist(), strict=True)
    ]
    # Few pairs are looked up line by line, many in a square.
    assert same_sheet(neighbours, first, second).tolist() == expected
    assert same_sheet(neighbours, first[:20], second[:20]).tolist() == expected[:20]
