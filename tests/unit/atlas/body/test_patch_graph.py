"""Patches of a body as a graph, against closed forms."""

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest

from tests.explored import explored
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas
from touchatlas.atlas.body.body import Body
from touchatlas.atlas.body.patch_graph import patch_graph
from touchatlas.sim import make_object


def test_a_ball_is_one_patch_that_bends_as_it_does():
    graph = explored("sphere").atlas.graph
    assert len(graph) == len(explored("sphere").atlas) == 1
    node = graph.nodes[0]
    # The radius is known to 0.001 of 33.
    assert [node["k1"], node["k2"]] == pytest.approx([-1.0 / 33.0] * 2, rel=1e-3)


def test_patches_of_a_bottle_are_one_graph():
    atlas = explored("bottle").atlas
    graph = atlas.graph
    assert 1 < len(graph) == len(atlas)
    assert nx.is_connected(graph)


@pytest.mark.parametrize("name", ["sphere", "bottle"])
def test_frames_stand_on_the_surface_with_its_normal(name):
    """Ten deviations of a sample of 0.02 mm off it, and 5 degrees turned, at most: the middle of
    a patch may lie beside the rim of what was touched."""
    obj = make_object(name)
    frames = [node["frame"] for _, node in explored(name).atlas.graph.nodes(data=True)]
    origins = np.array([frame.origin for frame in frames])
    assert np.linalg.norm(obj.project(origins) - origins, axis=1).max() < 0.2
    normals = np.array([frame.normal for frame in frames])
    assert (obj.normal(origins) * normals).sum(axis=1).min() > np.cos(np.deg2rad(5.0))


def test_patches_of_a_cube_meet_in_twelve_sharp_edges():
    graph = explored_sharp("block").atlas.graph
    assert len(graph) == 6
    kinds = [kind for *_, kind in graph.edges(data="kind")]
    assert len(kinds) == 12 and len(set(kinds)) == 1
    assert all(degree == 4 for _, degree in graph.degree())


def test_patches_meet_in_an_edge_that_no_contour_crossed():
    """It has no curve. The patches nearest to each other meet in it."""
    body = explored_sharp("block").atlas.body
    edges = tuple(replace(edge, curves=()) for edge in body.faces.edges)
    without = Body(replace(body.faces, edges=edges), body.samples)
    assert set(patch_graph(without).edges) == set(patch_graph(body).edges)


def test_nothing_touched_has_no_patches():
    assert len(Atlas(0.1).graph) == 0
