"""Bodies of exact surfaces with known volume: seams, poles and holes."""

import numpy as np
import pytest

from touchatlas.atlas.cad.edge_shapes import Arc, Line, curve_between
from touchatlas.atlas.cad.face_layout import FaceLayout, NotWritten, PlacedChain, cut_seams
from touchatlas.atlas.cad.fit_cone import Cone, cone_distances
from touchatlas.atlas.cad.law_surfaces import LawSurface
from touchatlas.atlas.cad.lawful_brep import brep_of
from touchatlas.atlas.cad.shared_points import farthest, shared_points

UP, DOWN = np.eye(3), np.diag([1.0, -1.0, -1.0])
# Where a line may stand for an edge of a body of size 1: far below 1e-9 of its volume.
EXACT = 1e-12


def ring(radius, height, count=24):
    """Points of a circle about z, counter-clockwise from above; the last is the first."""
    angle = np.append(np.arange(count), 0) / count * 2.0 * np.pi
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle + height])


def plane(height, axes=UP):
    return LawSurface("plane", np.array([0.0, 0.0, height]), axes)


def about_z(kind, radius, height=0.0, **more):
    return LawSurface(kind, np.array([0.0, 0.0, height]), UP, radius, **more)


def layout_of(surfaces, rings):
    """A layout of surfaces with closed chains (left, right, points)."""
    chains = [PlacedChain(a, b, p, k, k, True) for k, (a, b, p) in enumerate(rings)]
    loops = [
        [[(k, c.left == r)] for k, c in enumerate(chains) if r in (c.left, c.right)]
        for r in range(len(surfaces))
    ]
    return FaceLayout(list(surfaces), loops, chains, [p[0] for _, _, p in rings], {})


def cylinder():
    rings = [(0, 1, ring(0.5, 0.0)), (2, 0, ring(0.5, 1.0))]
    return layout_of([about_z("cylinder", 0.5), plane(0.0, DOWN), plane(1.0)], rings), np.pi / 4.0


def tube():
    surfaces = [
        about_z("cylinder", 0.5),
        plane(0.0, DOWN),
        plane(1.0),
        about_z("cylinder", 0.3, outward=-1.0),
    ]
    rings = [(0, 1, ring(0.5, 0.0)), (2, 0, ring(0.5, 1.0))]
    rings += [(1, 3, ring(0.3, 0.0)), (3, 2, ring(0.3, 1.0))]
    return layout_of(surfaces, rings), np.pi * (0.25 - 0.09)


def frustum():
    """Radii 0.7 and 0.2 at heights 0 and 1; the cone widens downward."""
    cone = LawSurface(
        "cone", np.array([0.0, 0.0, 0.5]), DOWN, 0.45, half_angle=float(np.arctan(0.5))
    )
    rings = [(0, 1, ring(0.7, 0.0)), (2, 0, ring(0.2, 1.0))]
    volume = np.pi / 3.0 * (0.7**2 + 0.7 * 0.2 + 0.2**2)
    return layout_of([cone, plane(0.0, DOWN), plane(1.0)], rings), volume


def tip():
    cone = LawSurface(
        "cone", np.array([0.0, 0.0, 0.5]), DOWN, 0.25, half_angle=float(np.arctan(0.5))
    )
    return layout_of([cone, plane(0.0, DOWN)], [(0, 1, ring(0.5, 0.0))]), np.pi / 12.0


def cut_ball():
    """A ball of radius 1 without what is above 0.6: a cap of height 0.4."""
    rings = [(1, 0, ring(0.8, 0.6))]
    volume = np.pi * (4.0 / 3.0 - 0.4**2 * (3.0 - 0.4) / 3.0)
    return layout_of([about_z("sphere", 1.0), plane(0.6)], rings), volume


def lens():
    """Two caps of height 0.4 of balls of radius 1."""
    spheres = [about_z("sphere", 1.0, -0.6), about_z("sphere", 1.0, 0.6)]
    volume = 2.0 * np.pi * 0.4**2 * (3.0 - 0.4) / 3.0
    return layout_of(spheres, [(0, 1, ring(0.8, 0.0))]), volume


def bowl():
    """A cylinder with a hollow cap of height 0.4 in its top."""
    surfaces = [
        about_z("cylinder", 0.9),
        plane(0.0, DOWN),
        plane(1.0),
        about_z("sphere", 1.0, 1.6, outward=-1.0),
    ]
    rings = [(0, 1, ring(0.9, 0.0)), (2, 0, ring(0.9, 1.0)), (3, 2, ring(0.8, 1.0))]
    return layout_of(surfaces, rings), np.pi * (0.81 - 0.4**2 * (3.0 - 0.4) / 3.0)


BODIES = [cylinder, tube, frustum, tip, cut_ball, lens, bowl]


def made(body):
    layout, volume = body()
    cut_seams(layout, [s.origin + np.eye(3) for s in layout.surfaces])
    return brep_of(layout, range(len(layout.surfaces)), EXACT), volume


@pytest.mark.parametrize("body", BODIES)
def test_a_body_of_exact_surfaces_is_one_valid_solid_of_its_volume(body):
    """The kernel integrates surfaces by Gauss's rule; 1e-9 is its error on circles."""
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from touchatlas.atlas.cad.occ_faces import face_shapes, is_valid

    brep, volume = made(body)
    (one,) = face_shapes(brep, dict.fromkeys(range(len(brep.faces)), "face"))
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(one.shape, found)
    assert is_valid(one.shape) and brep.closed == (True,)
    assert found.Mass() == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("body", BODIES)
def test_edges_are_circles_and_seams_straight_lines_or_meridians(body):
    """No spline where a name will do; the gap is the least, rounding of 1e-8 of the extent."""
    brep, _ = made(body)
    curves = [edge.curve for edge in brep.edges if edge.curve is not None]
    assert all(isinstance(curve, Line | Arc) for curve in curves)
    assert max(edge.gap for edge in brep.edges) <= 1e-7


def test_wires_go_around_in_the_parameters_of_their_surface():
    """On the parameter plane a wire with its seam encloses 2 pi times the height once, positive."""
    brep, _ = made(tube)
    for face in brep.faces:
        if face.surface.periodic:
            (wire,) = face.wires
            ends = [use.trace([0.0, use.trace.t[-1]])[:: 1 if use.forward else -1] for use in wire]
            corners = np.array([end[0] for end in ends])
            after = np.roll(corners, -1, axis=0)
            assert np.array([end[1] for end in ends]) == pytest.approx(after, abs=1e-9)
            twice = (corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]).sum()
            assert 0.5 * twice == pytest.approx(2.0 * np.pi, abs=1e-9)


@pytest.mark.parametrize("kind", ["plane", "cylinder", "cone", "sphere"])
def test_parameters_name_points_of_the_surface(kind):
    angle = 0.4 if kind == "cone" else 0.0
    surface = LawSurface(kind, np.array([3.0, -1.0, 2.0]), UP, 2.0, -1.0, angle)
    uv = np.random.default_rng(0).uniform([0.1, -1.0], [6.0, 1.0], (50, 2))
    points = surface.points(uv)
    assert surface.parameters(points) == pytest.approx(uv, abs=1e-12)
    distance, normal = surface.at(points + 0.0)
    assert distance == pytest.approx(0.0, abs=1e-14)
    moved, _ = surface.at(points + 0.01 * normal)
    assert moved == pytest.approx(0.01, abs=1e-12)


def test_a_slanted_cut_of_a_cylinder_is_a_spline_on_both_faces():
    """The error falls with the fourth power of the spacing, until it is below what was asked."""
    slant = plane(0.0).about(np.array([0.3, 0.1, 1.0]), np.array([1.0, 0.0, 0.0]))
    faces = [about_z("cylinder", 1.0), slant]
    points = shared_points(faces, ring(1.0, 0.0))
    points[-1] = points[0]
    curve = curve_between(faces, points, 1e-6)
    at = np.linspace(0.0, curve.last, 1000)
    assert farthest(faces, curve.points(at)) <= 1.5e-6
    assert curve.points([0.0, curve.last]) == pytest.approx(points[[0, -1]], abs=1e-12)


def test_where_tangent_surfaces_meet_points_go_half_way():
    """A plane at a distance d from a cylinder's side."""
    faces = [about_z("cylinder", 1.0), LawSurface("plane", np.array([1.02, 0, 0]), UP[[1, 2, 0]])]
    found = shared_points(faces, np.array([[1.1, 0.0, 0.5]]))
    assert found == pytest.approx(np.array([[1.01, 0.0, 0.5]]), abs=1e-12)


def test_a_face_that_goes_around_half_way_only_is_refused():
    """A cylinder with one closed bound ends nowhere."""
    layout = layout_of([about_z("cylinder", 0.5), plane(0.0, DOWN)], [(0, 1, ring(0.5, 0.0))])
    with pytest.raises(NotWritten, match="go around"):
        cut_seams(layout, [np.eye(3)] * 2)


def test_distances_from_a_cone_are_along_its_normals():
    cone = Cone(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.pi / 4.0)
    points = np.array([[1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert cone_distances(cone, points) == pytest.approx([0.0, np.sqrt(2.0), -np.sqrt(0.5)])
