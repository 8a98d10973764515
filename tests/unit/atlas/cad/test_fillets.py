"""Fillets of blunt edges: their radii, and what is written where the kernel makes none."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from tests.lawful import body_of, samples_of_touches, touched_mesh
from tests.lawful_meshes import HALF, RADIUS
from tests.unit.atlas.cad.smooth_bodies import volume
from touchatlas.atlas.body.body import Body
from touchatlas.atlas.cad import lawful as module
from touchatlas.atlas.cad.kernel import NotWritten
from touchatlas.atlas.cad.lawful import LawfulOptions, LawfulShapes, lawful_shapes
from touchatlas.atlas.faces.face_corners import find_corners

NOISE, TOLERANCE = 0.02, 0.2
BOX = 8.0 * HALF.prod()


@lru_cache
def sharp_body(name: str) -> Body:
    return body_of(samples_of_touches(touched_mesh(name, 60, NOISE), 1.5 * NOISE))


def made(radius_of, std, name="box") -> LawfulShapes:
    """Shapes of a body of sharp edges that are said to have the radii ``radius_of(first,
    second)``."""
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    faces = sharp_body(name).faces
    edges = tuple(
        replace(edge, radius=radius_of(edge.first, edge.second), radius_std=std)
        for edge in faces.edges
    )
    samples = sharp_body(name).samples
    corners = find_corners(faces.faces, edges, faces.points, faces.rounded, samples.std, 4.0)
    body = Body(replace(faces, edges=edges, corners=corners), samples)
    return lawful_shapes(body, TOLERANCE, LawfulOptions())


def taken_off(sharp: LawfulShapes, blunt: LawfulShapes) -> float:
    """Volume that fillets take from a body. Both have the same errors of their levels."""
    return volume(sharp.shapes[0].shape) - volume(blunt.shapes[0].shape)


def names(shapes: LawfulShapes) -> set[str]:
    """Of the fillets."""
    return set(shapes.shapes[0].names[6:])


def test_equal_radii_make_cylinders_and_spheres_of_exact_volume():
    """A ball that rolls within a box with the sides a, b and c about its middles fills abc +
    2 r (ab + bc + ca) + pi r^2 (a + b + c) + 4 pi r^3 / 3."""
    radius = 0.2
    sharp, blunt = made(lambda *_: 0.0, 0.01), made(lambda *_: radius, 0.01)
    assert (sharp.fillets, blunt.fillets, blunt.note) == (0, 20, "")
    assert names(blunt) == {"fillet, radius 0.200 \N{PLUS-MINUS SIGN} 0.003"}
    a, b, c = 2.0 * HALF - 2.0 * radius
    inner = a * b * c + 2.0 * radius * (a * b + b * c + c * a)
    wanted = inner + np.pi * radius**2 * (a + b + c) + 4.0 / 3.0 * np.pi * radius**3
    assert taken_off(sharp, blunt) == pytest.approx(BOX - wanted, rel=1e-3)


def test_the_rims_of_a_cylinder_are_rounded_though_its_axis_leans():
    """What is taken turns about the axis: a square less a quarter of a disc, by Pappus' rule."""
    radius = 0.2
    sharp, blunt = made(lambda *_: 0.0, 0.01, "cylinder"), made(lambda *_: radius, 0.01, "cylinder")
    assert (sharp.fillets, blunt.fillets, blunt.note) == (0, 2, "")
    disc = 0.25 * np.pi * radius**2 * (RADIUS - radius + 4.0 * radius / (3.0 * np.pi))
    taken = 2.0 * np.pi * (radius**2 * (RADIUS - 0.5 * radius) - disc)
    assert taken_off(sharp, blunt) == pytest.approx(2.0 * taken, rel=0.01)
    assert blunt.gap < 0.01 * TOLERANCE


def test_radii_that_differ_by_their_deviations_are_one():
    """The mean of all, since they have one deviation; a third of them are larger."""
    found = made(lambda first, _: 0.21 if first == 0 else 0.195, 0.01)
    assert names(found) == {"fillet, radius 0.200 \N{PLUS-MINUS SIGN} 0.003"}


def test_other_radii_are_kept_and_corners_between_them_have_none():
    found = made(lambda first, _: 0.2 if first == 0 else 0.1, 0.001)
    assert (found.fillets, found.note, len(found.shapes)) == (20, "", 1)
    assert {name[:18] for name in names(found)} == {
        "fillet, radius 0.1",
        "fillet, radius 0.2",
        "fillet",
    }
    assert found.gap < 0.01 * TOLERANCE


def test_one_blunt_edge_is_one_fillet():
    found = made(lambda *pair: 0.2 if pair == (0, 2) else 0.0, 0.001)
    assert (found.fillets, len(found.shapes)) == (1, 1)


def test_where_fillets_fail_edges_are_sharp_within_the_tolerance():
    """A radius that is nothing to the kernel; it is off by sqrt(3) - 1 of itself in a corner."""
    found = made(lambda *_: 1e-9, 1e-12)
    assert (found.fillets, len(found.shapes[0].faces)) == (0, 6)
    assert found.note.startswith("rounded edges are written sharp, off by 7.3")


def test_where_fillets_fail_beyond_the_tolerance_there_are_no_faces(monkeypatch):
    """A radius of two tolerances is off by 1.5 in a corner; one of one tolerance is not."""

    def refuse(one, edges, radii):
        raise NotWritten("no fillets")

    monkeypatch.setattr(module, "with_fillets", refuse)
    assert made(lambda *_: 0.2, 0.01).fillets == 0
    with pytest.raises(NotWritten, match="no fillets"):
        made(lambda *_: 0.4, 0.01)


def test_errors_of_the_kernel_are_reasons(monkeypatch):
    """They have no class in common in Python."""
    standard = pytest.importorskip("OCP.Standard", reason="needs the extra cad")

    def refuse(one, edges, radii):
        raise standard.Standard_ConstructionError("too close")

    monkeypatch.setattr(module, "with_fillets", refuse)
    assert "the CAD kernel refuses a face: too close" in made(lambda *_: 0.1, 0.01).note
