"""Trimmed patches against the power diagram that they are cut by, and against theorems."""

from collections import Counter

import numpy as np
import pytest

from tests.explored import explored
from touchatlas.atlas import Atlas, extract_surface
from touchatlas.atlas.cad.bezier import bernstein, curve_poles
from touchatlas.atlas.cad.trim_curves import shared_curve
from touchatlas.atlas.cad.trimmed_patches import trimmed_patches
from touchatlas.atlas.graph.power_diagram import power_at
from touchatlas.patch.geometry.polynomial import gaussian_curvature

RADIUS = 33.0


@pytest.fixture(scope="module")
def ball():
    atlas = explored("sphere").atlas
    return atlas, trimmed_patches(atlas)


@pytest.fixture(scope="module")
def half():
    """A ball of which some 25 touches leave much open."""
    atlas = explored("sphere", max_touches=25).atlas
    atlas.refit_all()
    return atlas, trimmed_patches(atlas)


def test_every_side_is_shared_by_two_faces_point_by_point(ball):
    atlas, faces = ball
    sides = {}
    for face in faces:
        for side in face.sides:
            sides.setdefault(side.number, []).append((face.patch.id, side))
    assert len(sides) == atlas.graph.number_of_edges()
    for (i, first), (j, second) in sides.values():
        assert (first.neighbour, second.neighbour) == (j, i)
        assert (first.points == second.points[::-1]).all()


@pytest.mark.parametrize("which", ["ball", "half"])
def test_loops_are_closed_and_their_corners_are_those_of_the_cells(which, request):
    atlas, faces = request.getfixturevalue(which)
    corners = {point.tobytes() for point in atlas.corners.values()}
    seen = set()
    for face in faces:
        for side, following in zip(face.sides, face.sides[1:] + face.sides[:1], strict=True):
            assert (side.points[-1] == following.points[0]).all()
            seen.add(side.points[-1].tobytes())
    # One outward of all cores may begin no side.
    assert len(corners - seen) <= 0.05 * len(corners)


@pytest.mark.parametrize("which", ["ball", "half"])
def test_sides_lie_where_powers_are_equal_or_nothing(which, request):
    """On the radical plane exactly, up to the corners, which Newton left at 1e-9 of the power;
    on the rim within the 5 % of the power that a corner may lie outside a core."""
    atlas, faces = request.getfixturevalue(which)
    table = atlas.table
    for face in faces:
        i = face.patch.id
        for side in face.sides:
            own = power_at(table, [i], side.points)[:, 0]
            if side.neighbour is None:
                assert np.abs(own).max() < 0.05 * table.weight[i]
            else:
                other = power_at(table, [side.neighbour], side.points)[:, 0]
                assert own == pytest.approx(other, abs=1e-6 * table.weight[i])


def test_arc_is_its_curve_between_its_points_too(ball):
    """A polynomial of degree 8 through Chebyshev points, against the curve itself: an arc turns
    by less than its patch, 45 degrees, and the interpolant of such a circle's arc misses it by
    2 (turn/4)^9/9! of its radius, 1e-11; a quartic's section is a little less smooth."""
    atlas, faces = ball
    along = bernstein(8, np.linspace(0.03, 0.97, 30))
    for face in faces[:20]:
        for side in face.sides:
            if side.neighbour < face.patch.id:
                continue
            pair = (face.patch, atlas.patch(side.neighbour))
            ids = [p.id for p in pair]
            curve = shared_curve(*pair, atlas.table.site[ids], atlas.table.weight[ids])
            points = along @ curve_poles(side.points)
            abscissa = (points - curve.base) @ curve.along
            first, last = side.points[[0, -1]]
            ends = [curve.abscissa(first), curve.abscissa(last)]
            along_chord = (abscissa - ends[0]) / (ends[1] - ends[0])
            wanted = curve.at(abscissa)
            wanted += np.outer(1.0 - along_chord, first - curve.at(np.array(ends[:1]))[0])
            wanted += np.outer(along_chord, last - curve.at(np.array(ends[1:]))[0])
            assert np.abs(points - wanted).max() < 1e-7 * RADIUS


def inside(loop, points) -> np.ndarray:
    """Whether points (n, 2) lie in a polygon: crossings of a ray (Shimrat, CACM 5, 1962)."""
    ahead = np.roll(loop, -1, axis=0)
    x, y = points.T[:, :, None]
    straddles = (loop[:, 1] > y) != (ahead[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        cut = loop[:, 0] + (y - loop[:, 1]) * (ahead - loop)[:, 0] / (ahead - loop)[:, 1]
    return (straddles & (x < cut)).sum(axis=1) % 2 == 1


@pytest.mark.parametrize("which", ["ball", "half"])
def test_face_holds_just_the_points_of_its_cell(which, request):
    """Random points of a patch: in its loop where no sheet neighbour has less power, and within its
    core where it is open. The loop is midway between two patches, the cell here on one of them:
    their normals differ by some 0.01, their heights by 0.01, the cell is 14 wide; of 1,000
    points none or one falls between."""
    atlas, faces = request.getfixturevalue(which)
    rng, table = np.random.default_rng(3), atlas.table
    wrong = total = 0
    along = bernstein(8, np.linspace(0.0, 1.0, 25)[:-1])
    for face in faces:
        patch, i = face.patch, face.patch.id
        reach = 1.05 * patch.core * patch.radius
        xy = rng.uniform(-reach, reach, (1000, 2))
        points = patch.frame.to_world(np.column_stack([xy, patch.polynomial.height(xy)]))
        own = power_at(table, [i], points)[:, 0]
        cell = own <= (0.05 * table.weight[i] if face.closed else 0.0)
        if atlas.neighbours[i]:
            cell &= own <= power_at(table, sorted(atlas.neighbours[i]), points).min(axis=1)
        loop = np.concatenate([along @ curve_poles(trace) for trace in face.traces])
        wrong += int((cell != inside(loop, xy)).sum())
        total += int(cell.sum())
    assert wrong < 1e-3 * total


def test_areas_of_a_closed_atlas_sum_to_that_of_its_surface(ball):
    """4 pi r^2 on the ball: a mean radial error of 0.002, the noise over the root of the samples
    of a patch, is 1e-4 of the area. The triangles lack their sagitta, 0.02 tolerances, on either
    side: 2 * 0.002/33 as well."""
    atlas, faces = ball
    area = sum(face.area for face in faces)
    assert area == pytest.approx(4.0 * np.pi * RADIUS**2, rel=2e-4)
    surface = extract_surface(atlas)
    a, b, c = surface.vertices[surface.faces].transpose(1, 0, 2)
    triangles = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert area == pytest.approx(triangles, rel=2e-4)


def test_total_curvature_of_closed_trimmed_patches_is_four_pi(ball):
    """Gauss and Bonnet: what the faces lack is the angle at their sides, whose normals differ
    by some 0.01; it has either sign."""
    total = 0.0
    for face in ball[1]:
        points, weights = face.quadrature()
        slope = face.patch.polynomial.gradient(points)
        second = face.patch.polynomial.hessian(points)
        stretch = np.sqrt(1.0 + (slope * slope).sum(axis=1))
        total += weights @ (gaussian_curvature(*slope.T, *second.T) * stretch)
    assert total == pytest.approx(4.0 * np.pi, rel=0.01)


def test_area_of_open_trimmed_patches_is_what_the_cores_cover(half):
    """Against 40,000 even random points of the ball in any core; within four standard errors."""
    atlas, faces = half
    assert not all(face.closed for face in faces)
    points = np.random.default_rng(4).normal(size=(40_000, 3))
    points *= RADIUS / np.linalg.norm(points, axis=1)[:, None]
    fraction = np.mean(power_at(atlas.table, atlas.table.rows, points).min(axis=1) <= 0.0)
    found = sum(face.area for face in faces) / (4.0 * np.pi * RADIUS**2)
    assert found == pytest.approx(fraction, abs=4.0 * np.sqrt(fraction * (1.0 - fraction) / 40_000))


def test_first_patch_is_trimmed_by_its_whole_rim():
    """Its core is a sphere of radius c: on a ball of radius r it cuts a cap of area pi c^2
    (Archimedes). One touch leaves the curvature known to some 2 %, which tells as c^2/(8 r^2)."""
    atlas = explored("sphere", max_touches=1).atlas
    (face,) = trimmed_patches(atlas)
    assert set(face.neighbours) == {None}
    assert face.area == pytest.approx(np.pi * atlas.table.weight[0], rel=0.01)


def test_scaling_all_input_scales_the_trimmed_patches(ball):
    twice = trimmed_patches(explored("sphere", scale=2.0).atlas)
    for face, other in zip(ball[1], twice, strict=True):
        assert face.neighbours == other.neighbours
        assert other.area == pytest.approx(4.0 * face.area, rel=1e-7)


def test_torus_closes_without_a_hole():
    faces = trimmed_patches(explored("torus").atlas)
    assert all(face.closed for face in faces)
    assert set(Counter(s.number for f in faces for s in f.sides).values()) == {2}


def test_an_atlas_of_nothing_is_refused():
    with pytest.raises(ValueError, match="no patch yet"):
        trimmed_patches(Atlas(0.1))
