"""Bodies of exact surfaces with known volume: seams, poles, holes and smooth rims."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.unit.atlas.cad.smooth_bodies import volume
from touchatlas.atlas.cad.cells import large_faces, make_circles, solids_inside
from touchatlas.atlas.cad.kernel import NotWritten, is_valid, largest_tolerance, listed
from touchatlas.atlas.cad.rims import Rim, made_tangent, rim_plane
from touchatlas.atlas.cad.surfaces import LawSurface, law_surface
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.laws import law_of

UP, DOWN = np.eye(3), np.diag([1.0, -1.0, -1.0])
EXTENT = 2.0


def plane(height, axes=UP):
    return LawSurface("plane", np.array([0.0, 0.0, height]), axes)


def side(normal, level):
    """A plane along z."""
    normal = np.array(normal, float)
    return LawSurface(
        "plane", level * normal, np.stack([np.cross([0, 0, 1.0], normal), UP[2], normal])
    )


def about_z(kind, radius, height=0.0, **more):
    return LawSurface(kind, np.array([0.0, 0.0, height]), UP, radius, **more)


def sloping(radius, height):
    """A cone that widens downward by half of the height."""
    origin = np.array([0.0, 0.0, height])
    return LawSurface("cone", origin, DOWN, radius, half_angle=float(np.arctan(0.5)))


def frustum():
    """Radii 0.7 and 0.2 at heights 0 and 1."""
    volume = np.pi / 3.0 * (0.7**2 + 0.7 * 0.2 + 0.2**2)
    return [sloping(0.45, 0.5), plane(0.0, DOWN), plane(1.0)], volume


def cut_ball():
    """A ball of radius 1 without what is above 0.6: a cap of height 0.4."""
    volume = np.pi * (4.0 / 3.0 - 0.4**2 * (3.0 - 0.4) / 3.0)
    return [about_z("sphere", 1.0), plane(0.6)], volume


def lens():
    """Two caps of height 0.4 of balls of radius 1."""
    volume = 2.0 * np.pi * 0.4**2 * (3.0 - 0.4) / 3.0
    return [about_z("sphere", 1.0, -0.6), about_z("sphere", 1.0, 0.6)], volume


def tube():
    ends = [plane(0.0, DOWN), plane(1.0)]
    walls = [about_z("cylinder", 0.5), about_z("cylinder", 0.3, outward=-1.0)]
    return [*walls, *ends], np.pi * (0.25 - 0.09)


def bowl():
    """A cylinder with a hollow cap of height 0.4 in its top."""
    hollow = about_z("sphere", 1.0, 1.6, outward=-1.0)
    walls = [about_z("cylinder", 0.9), plane(0.0, DOWN), plane(1.0)]
    return [*walls, hollow], np.pi * (0.81 - 0.4**2 * (3.0 - 0.4) / 3.0)


BODIES = {
    "cylinder": ([about_z("cylinder", 0.5), plane(0.0, DOWN), plane(1.0)], np.pi / 4.0),
    "ball": ([about_z("sphere", 1.0)], 4.0 / 3.0 * np.pi),
    # Pappus: the area of the section times the way of its middle.
    "ring": ([about_z("torus", 0.2, ring=0.6)], 0.04 * np.pi * 1.2 * np.pi),
    "tip": ([sloping(0.25, 0.5), plane(0.0, DOWN)], np.pi / 12.0),
    "frustum": frustum(),
    "cut ball": cut_ball(),
    "lens": lens(),
    "tube": tube(),
    "bowl": bowl(),
}


def solids(surfaces, rims=(), samples=None):
    """The solids of the points that are inside of all surfaces."""
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    corners = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
    samples = samples or dict.fromkeys(range(len(surfaces)), corners)
    large = large_faces(dict(enumerate(surfaces)), list(rims), samples, EXTENT)

    def distances(points):
        return np.max([surface.at(points)[0] for surface in surfaces], axis=0)

    return solids_inside(large, distances, 0.0, EXTENT)


@pytest.mark.parametrize("name", BODIES)
def test_a_body_of_exact_surfaces_is_one_valid_solid_of_its_volume(name):
    """The kernel integrates surfaces by Gauss's rule; 1e-9 is its error on circles."""
    surfaces, wanted = BODIES[name]
    (one,) = solids(surfaces)
    assert is_valid(one.shape) and sorted(one.numbers) == list(range(len(surfaces)))
    assert volume(one.shape) == pytest.approx(wanted, rel=1e-9)
    assert largest_tolerance(one.shape) < 1e-6


def test_an_edge_across_a_leaning_axis_is_a_circle_within_the_difference_of_its_half_axes():
    """Cut at an angle a, a cylinder of radius r has half axes of r and r / cos a."""
    angle = 0.01
    cosine, sine = np.cos(angle), np.sin(angle)
    lean = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    (one,) = solids([LawSurface("cylinder", np.zeros(3), lean, 0.5), plane(0.0, DOWN), plane(1.0)])
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GeomAbs import GeomAbs_Circle

    off = 0.5 * (1.0 / cosine - 1.0)
    for allowed, count in ((0.9 * off, 0), (1.1 * off, 2)):
        make_circles(one.shape, allowed)
        kinds = [BRepAdaptor_Curve(edge).GetType() for edge in listed(one.shape, "Edge")]
        assert kinds.count(GeomAbs_Circle) == count
    assert is_valid(one.shape)
    assert largest_tolerance(one.shape) == pytest.approx(off, rel=0.02)


def test_faces_that_enclose_nothing_are_no_solid():
    """A cylinder with one end."""
    with pytest.raises(NotWritten, match="enclose nothing"):
        solids([about_z("cylinder", 0.5), plane(0.0, DOWN)])


def test_two_parts_are_two_solids():
    """What is inside of a slab and outside of a wall across it."""
    slab = [side(n, 0.5) for n in ([1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0])]
    wall = about_z("cylinder", 0.4, outward=-1.0)
    ends = [plane(-0.3, DOWN), plane(0.3)]
    across = LawSurface("cylinder", wall.origin, UP[[1, 2, 0]], 0.45, -1.0)
    assert [len(one.faces) for one in solids([*slab, *ends])] == [6]
    assert len(solids([*slab, *ends, across])) == 2


def stadium(error=0.0):
    """Two half cylinders of radius 0.4 and two planes tangent to them but for an error."""
    ends = [plane(0.0, DOWN), plane(0.5)]
    walls = [side([0, 1, 0], 0.4 + error), side([0, -1, 0], 0.4 - 0.5 * error)]
    at = np.array([0.3, error, 0.0])
    rounds = [LawSurface("cylinder", sign * at, UP, 0.4) for sign in (1.0, -1.0)]
    return [*walls, *rounds, *ends], 0.5 * (np.pi * 0.16 + 0.6 * 0.8)


def stadium_rims():
    height = np.linspace(0.05, 0.45, 9)
    return [
        Rim(wall, round_, np.column_stack([np.full(9, x), np.full(9, y), height]))
        for wall, y in ((0, 0.4), (1, -0.4))
        for round_, x in ((2, 0.3), (3, -0.3))
    ]


@pytest.mark.parametrize("error", [1e-3, -1e-3])
def test_surfaces_that_are_nearly_tangent_become_tangent(error):
    """They move by about the error. Without, they intersect in two curves or in none."""
    surfaces, _ = stadium(error)
    found = made_tangent(dict(enumerate(surfaces)), stadium_rims(), EXTENT)
    for wall in (0, 1):
        for number in (2, 3):
            distance = -found[wall].at(found[number].origin[None])[0][0]
            assert distance == pytest.approx(found[number].radius, abs=1e-8)
            assert found[wall].axes[2] @ found[number].axes[2] == pytest.approx(0.0, abs=1e-8)
    moved = [np.abs(found[k].origin - surfaces[k].origin).max() for k in range(len(surfaces))]
    assert 0.0 < max(moved) < 3.0 * abs(error)
    assert moved[4:] == [0.0, 0.0]


def test_tangent_faces_end_at_their_rims():
    """Two half cylinders with planes between them, of which samples lie on one side of each rim."""
    surfaces, wanted = stadium(1e-3)
    rims = stadium_rims()
    found = made_tangent(dict(enumerate(surfaces)), rims, EXTENT)
    angle = np.linspace(-1.5, 1.5, 40)
    arc = np.column_stack([0.3 + 0.4 * np.cos(angle), 0.4 * np.sin(angle), 0.25 + 0.0 * angle])
    line = np.column_stack([np.linspace(-0.29, 0.29, 40), np.full((40, 2), [0.4, 0.25])])
    turn = np.array([-1.0, -1.0, 1.0])
    flat = np.array([[-0.6, -0.4, 0.0], [0.6, 0.4, 0.5]])
    samples = {0: line, 1: turn * line, 2: arc, 3: turn * arc, 4: flat, 5: flat}
    (one,) = solids(list(found.values()), rims, samples)
    assert is_valid(one.shape) and sorted(one.numbers) == list(range(6))
    assert volume(one.shape) == pytest.approx(wanted, rel=5e-3)


def test_surfaces_touch_in_a_plane_with_an_axis_or_across_it():
    pin = about_z("cylinder", 0.5)
    flat = rim_plane(side([1, 0, 0], 0.5), pin)
    assert flat is not None and flat.is_half
    assert flat.surface.axes[0] == pytest.approx([1.0, 0.0, 0.0])
    other = LawSurface("cylinder", np.array([0.0, 0.8, 0.0]), UP, 0.3)
    beside = rim_plane(pin, other)
    assert beside is not None and beside.surface.axes[0] == pytest.approx([0.0, 1.0, 0.0])
    round_ = rim_plane(about_z("sphere", 0.5, 1.0), pin)
    assert round_ is not None and not round_.is_half
    assert round_.surface.at(np.array([[7.0, 3.0, 1.0]]))[0] == pytest.approx(0.0)
    assert rim_plane(plane(0.0), plane(1.0)) is None


def test_a_ball_touches_a_cone_where_their_normals_agree():
    """A ball in the tip of a cone: the circle is below its middle by the sine of the half angle."""
    cone = sloping(0.0, 0.0)
    radius, sine = 0.2, np.sin(cone.half_angle)
    ball = LawSurface("sphere", np.array([0.0, 0.0, -radius / sine]), UP, radius)
    found = rim_plane(ball, cone)
    assert found is not None
    height = float(found.surface.origin[2])
    away = np.sqrt(radius**2 - (height - ball.origin[2]) ** 2)
    point = np.array([[away, 0.0, height]])
    assert cone.at(point)[0] == pytest.approx(0.0, abs=1e-12)
    assert cone.at(point)[1] == pytest.approx(ball.at(point)[1], abs=1e-12)


TURNED = np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]])


@pytest.mark.parametrize("kind", ["plane", "cylinder", "cone", "sphere", "torus"])
def test_the_normal_is_the_way_in_which_the_distance_grows(kind):
    for outward in (1.0, -1.0) if kind != "plane" else (1.0,):
        angle = 0.4 if kind == "cone" else 0.0
        ring = 5.0 if kind == "torus" else 0.0
        surface = LawSurface(kind, np.array([3.0, -1.0, 2.0]), TURNED, 2.0, outward, angle, ring)
        points = surface.origin + np.random.default_rng(0).uniform(0.5, 1.5, (50, 3)) @ TURNED
        distance, normal = surface.at(points)
        moved, same = surface.at(points + 0.01 * normal)
        assert moved - distance == pytest.approx(0.01, abs=1e-12)
        assert same == pytest.approx(normal, abs=1e-12)


def test_the_surface_of_a_cone_is_that_of_its_law():
    """Samples without error, all around and from a third of the height on."""
    cone = LawSurface("cone", np.array([3.0, -1.0, 2.0]), TURNED, half_angle=0.4)
    angle, height = (x.ravel() for x in np.meshgrid(np.arange(24) / 12.0 * np.pi, [1.0, 2.0, 3.0]))
    away = np.column_stack([np.cos(angle), np.sin(angle)]) * np.tan(0.4) * height[:, None]
    points = cone.origin + np.column_stack([away, height]) @ TURNED
    piece = fit_piece(Kind.CONE, points, cone.at(points)[1], 1e-6)
    assert piece is not None
    law = law_of(piece, points, 1e-6)
    found = law_surface(SimpleNamespace(kind="cone", law=law, pieces=[piece]), points)
    assert found is not None
    assert (found.kind, found.outward) == ("cone", 1.0)
    assert found.half_angle == pytest.approx(0.4, abs=1e-4)
    assert found.at(points)[0] == pytest.approx(0.0, abs=1e-4)
