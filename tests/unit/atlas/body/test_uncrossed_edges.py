"""Edges that no contour crossed: the surface of a lawful body shows where they are."""

from dataclasses import replace

import numpy as np
import pytest

from tests.lawful import NOISE, box_distance, known_body, step_distance
from tests.lawful_meshes import HALF, PLATE
from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.uncrossed_edges import points_beside, with_uncrossed_edges

DISTANCE = {"box": box_distance, "step": step_distance}


def body_without(name: str, left_out, curves_only: bool):
    """A body of which some edges are not known, or their curves are not."""
    body = known_body(name, 40)
    edges = [
        replace(edge, curves=(), length=0.0) if k in left_out else edge
        for k, edge in enumerate(body.faces.edges)
        if curves_only or k not in left_out
    ]
    return body, Body(replace(body.faces, edges=tuple(edges)), body.samples)


@pytest.mark.parametrize("name", ["box", "step"])
@pytest.mark.parametrize("left_out", [[0], [2, 5], [4, 7, 10]])
@pytest.mark.parametrize("curves_only", [False, True])
def test_an_edge_that_was_left_out_is_found_on_the_surface(name, left_out, curves_only):
    """Points of both planes err by some thousandths; five noises are none of them. Half of the
    length of an edge is seen where contours crossed it on three quarters."""
    whole, body = body_without(name, left_out, curves_only)
    found = {(e.first, e.second): e for e in with_uncrossed_edges(body).edges}
    for k in left_out:
        before = whole.faces.edges[k]
        edge = found[before.first, before.second]
        assert edge.kind is before.kind
        assert edge.length > 0.5 * before.length
        assert np.abs(DISTANCE[name](np.concatenate(edge.curves))).max() < 5.0 * NOISE


@pytest.mark.parametrize(("name", "count", "half"), [("box", 40, HALF), ("plate", 50, PLATE)])
def test_every_point_of_an_edge_of_planes_lies_on_two_of_the_body(name, count, half):
    """Opposite sides of a plate bound each other, and have no edge."""
    body = known_body(name, count)
    edges = with_uncrossed_edges(body).edges
    pairs = {(edge.first, edge.second) for edge in body.faces.edges}
    assert pairs <= {(edge.first, edge.second) for edge in edges}
    # One side of the plate, whose samples are few, is a quadric from these touches.
    plane = [face.kind == "plane" for face in body.faces.faces]
    between = [edge for edge in edges if plane[edge.first] and plane[edge.second]]
    points = np.concatenate([curve for edge in between for curve in edge.curves])
    off = np.sort(np.abs(np.abs(points) - half), axis=1)
    assert off[:, 1].max() < 5.0 * NOISE


def test_where_two_faces_have_one_normal_there_is_no_edge():
    """Two parts of one plane: no way leads from the one to the other."""
    points, up = np.zeros((3, 3)), np.tile([0.0, 0.0, 1.0], (3, 1))
    assert np.isnan(points_beside(points, up, up, 1.0)).all()


def test_points_beside_an_edge_lie_on_its_faces():
    """The top and the right side of a block: beside their convex edge the top goes to the left, and
    the side down; beside a concave one the floor goes to the right, and the wall up."""
    points, up, right = np.zeros((1, 3)), np.eye(3)[2:], np.eye(3)[:1]
    convex, concave = points_beside(points, up, right, 2.0)
    assert convex[:, 0].tolist() == [[-2.0, 0.0, 0.0], [0.0, 0.0, -2.0]]
    assert concave[:, 0].tolist() == [[2.0, 0.0, 0.0], [0.0, 0.0, 2.0]]
