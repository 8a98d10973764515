"""The blend against its definition patch by patch."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import explored
from touchatlas.atlas.field.patch_values import COVER_MARGIN
from touchatlas.atlas.graph.power_diagram import CELL_MARGIN
from touchatlas.atlas.known_surface import blend_of_patches


@pytest.fixture(scope="module")
def torus():
    return explored("torus", max_touches=60).atlas


def near_the_surface(atlas, rng, count, reach):
    """Points (n, 3) within ``reach`` patch radii of patch origins."""
    rows = rng.choice(atlas.table.rows, size=count)
    spread = reach * rng.uniform(-1.0, 1.0, (count, 3)) * atlas.table.radius[rows, None]
    return atlas.table.origin[rows] + spread


def powers(atlas, rows, point):
    return ((point - atlas.table.site[rows]) ** 2).sum(axis=1) - atlas.table.weight[rows]


def blend_by_definition(atlas, point):
    """Distance, normal, deviation and owner at a point, a patch at a time."""
    found, own = {}, {}
    for i in sorted(atlas.graph):
        patch = atlas.patch(i)
        local = patch.frame.to_local(point[None])[0] / patch.radius
        distance = patch.signed_distance(point[None])[0]
        if local @ local > 1.0 or abs(distance) > 0.5 * patch.radius:
            continue
        normal, deviation = patch.normal(point[None])[0], patch.deviation(point[None])[0]
        # What the degree leaves out is in the deviation, but not in the weights.
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
    points = near_the_surface(torus, np.random.default_rng(0), 40, 0.6)
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
    assert 12 < known < 40


def test_a_point_alone_has_the_same_distance_as_among_many(torus):
    """Points that share look-ups and groups of patches do not influence each other."""
    points = near_the_surface(torus, np.random.default_rng(1), 20_000, 0.1)
    together, few = torus.blend(points), np.arange(0, 20_000, 397)
    alone = torus.blend(points[few])
    assert (together.patch[few] == alone.patch).all()
    assert together.distance[few] == pytest.approx(alone.distance, abs=1e-12, nan_ok=True)


def test_without_curvatures_a_blend_is_the_same_and_some_of_it_is_some_of_its_points():
    """Products of other shapes round differently."""
    atlas = explored("torus", max_touches=25).atlas
    points = atlas.membership.pool.points[::7]
    whole, flat = blend_of_patches(atlas, points), blend_of_patches(atlas, points, curved=False)
    assert np.isnan(flat.gaussian_curvature).all()
    assert np.isfinite(whole.gaussian_curvature[whole.known]).all()
    assert np.array_equal(flat.patch, whole.patch)
    assert np.allclose(flat.distance, whole.distance, rtol=0.0, atol=1e-12, equal_nan=True)
    some = flat.some(slice(3, 9))
    assert np.array_equal(some.normal, flat.normal[3:9], equal_nan=True) and len(some.known) == 6
