"""An atlas as a mesh, a graph, a table and one line."""

import networkx as nx
import numpy as np

from tests.explored import explored
from touchatlas.atlas import Atlas, extract_surface


def test_a_mesh_of_trimesh_has_the_triangles_and_the_numbers_of_each_vertex():
    atlas = explored("sphere").atlas
    surface, mesh = extract_surface(atlas), atlas.to_trimesh()
    assert mesh.is_watertight and mesh.euler_number == 2
    np.testing.assert_array_equal(mesh.faces, surface.faces)
    np.testing.assert_array_equal(mesh.vertices, surface.vertices)
    np.testing.assert_array_equal(mesh.vertex_attributes["deviation"], surface.deviation)
    np.testing.assert_array_equal(mesh.vertex_attributes["patch"], surface.patch)


def test_the_graph_and_the_table_name_the_same_faces():
    atlas = explored("sphere").atlas
    graph, rows = atlas.to_networkx(), atlas.faces().table()
    assert nx.utils.graphs_equal(graph, atlas.faces().graph())
    assert {row["face"]: row["words"] for row in rows} == dict(graph.nodes(data="words"))


def test_one_line_says_what_is_held():
    found = explored("sphere")
    assert repr(Atlas(0.1)) == "<Atlas: 0 touches, 0 samples, tolerance 0.1>"
    line, surface = repr(found.atlas), repr(extract_surface(found.atlas))
    assert f"{len(found.touches)} touches" in line and "faces: 1 " in line and "\n" not in line
    assert surface.endswith("of 1 face, closed>")
