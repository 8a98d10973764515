"""Patches of a body as a graph, against closed forms."""

import networkx as nx
import numpy as np

from tests.explored import explored
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas


def test_patches_of_a_ball_bend_as_it_does_and_are_one_graph():
    atlas = explored("sphere").atlas
    graph = atlas.graph
    # Second derivatives of a sextic of the whole ball are sure to a thousandth; a hundredth allows
    # for those at the rim of what was touched.
    bends = np.array([[node["k1"], node["k2"]] for _, node in graph.nodes(data=True)])
    assert np.allclose(np.median(bends, axis=0), -1.0 / 33.0, rtol=1e-2)
    assert len(graph) == len(atlas)
    assert nx.is_connected(graph)


def test_frames_stand_on_the_surface_with_its_normal():
    graph = explored("sphere").atlas.graph
    for _, node in graph.nodes(data=True):
        frame = node["frame"]
        radius = np.linalg.norm(frame.origin)
        # Five deviations of a sample of 0.02 mm, and the angle that these are of a radius.
        assert abs(radius - 33.0) < 0.1
        assert frame.normal @ frame.origin / radius > 1.0 - 1e-3


def test_patches_of_a_cube_meet_in_twelve_sharp_edges():
    graph = explored_sharp("block").atlas.graph
    assert len(graph) == 6
    kinds = [kind for *_, kind in graph.edges(data="kind")]
    assert len(kinds) == 12 and len(set(kinds)) == 1
    assert all(degree == 4 for _, degree in graph.degree())


def test_nothing_touched_has_no_patches():
    assert len(Atlas(0.1).graph) == 0
