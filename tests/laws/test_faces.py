"""Faces of touched bodies: their kinds, their edges, and their graph."""

import json
import re
from functools import lru_cache
from xml.etree import ElementTree

import networkx as nx
import numpy as np
import pytest

from tests.explored import explored, learned_at_once, spread_touches
from tests.sharp import explored_sharp, sharp_object
from touchatlas.atlas import (
    Atlas,
    EdgeKind,
    Faces,
    face_values,
    write_graphml,
    write_json,
)
from touchatlas.atlas.body.read_faces import samples_of

# Faces, convex and concave edges.
BODIES = {"block": (6, 12, 0), "step": (8, 17, 1), "roof": (7, 15, 0)}


@lru_cache
def atlas_of(name: str) -> Atlas:
    """An explored body; roof and step are touched at places spread evenly, which takes less
    time."""
    if name in ("roof", "step"):
        return learned_at_once(spread_touches(sharp_object(name), 30), 0.1)
    return explored(name).atlas if name == "sphere" else explored_sharp(name).atlas


@lru_cache
def faces_of(name: str) -> Faces:
    return atlas_of(name).faces()


@pytest.mark.parametrize("name", BODIES)
def test_a_polyhedron_has_its_planes_and_its_edges(name):
    faces, (planes, convex, concave) = faces_of(name), BODIES[name]
    assert [face.kind for face in faces.faces] == planes * ["plane"]
    kinds = [edge.kind for edge in faces.edges]
    # Few contours end at the step's two short edges beside its concave one: one may be missed.
    assert convex - 2 * concave <= kinds.count(EdgeKind.SHARP_CONVEX) <= convex
    assert kinds.count(EdgeKind.SHARP_CONCAVE) == concave
    assert all(kind.sharp for kind in kinds)


@pytest.mark.parametrize("name", BODIES)
def test_no_face_rests_on_one_contour(name):
    """A curve in a plane lies on many faces. At the roof a contour that grazed a plane made one."""
    atlas, faces = atlas_of(name), faces_of(name)
    pool = atlas.pool
    contours = samples_of(pool, len(pool), atlas.sample_std).contours
    assert all(len(np.unique(contours[face.samples])) > 1 for face in faces.faces)


@pytest.mark.parametrize("name", BODIES)
def test_points_of_an_edge_lie_on_both_its_planes(name):
    """Newton's method ends where both distances are zero; five steps square the error each."""
    faces = faces_of(name)
    # Of an edge at which few contours end no line may be found: of one at most.
    drawn = [edge for edge in faces.edges if edge.curves]
    assert len(drawn) >= len(faces.edges) - 1
    for edge in drawn:
        points = np.concatenate(edge.curves)
        for k in (edge.first, edge.second):
            law = faces.faces[k].law.numbers
            height = points @ law["normal"] - law["level"]
            assert np.abs(height).max() < 1e-9


def test_a_ball_is_one_face_without_edges():
    faces = faces_of("sphere")
    assert len(faces) == 1 and not faces.edges
    numbers = faces.faces[0].law.numbers
    assert abs(numbers["radius"] - 33.0) < 4.0 * numbers["radius_std"]
    assert np.linalg.norm(numbers["centre"]) < 4.0 * np.sqrt(3.0) * numbers["centre_std"]
    assert faces.unexplained < 0.001


def test_the_graph_has_words_and_numbers_that_graphml_and_json_keep(tmp_path):
    faces = faces_of("step")
    write_graphml(faces, tmp_path / "faces.graphml")
    write_json(faces, tmp_path / "faces.json")
    read = nx.read_graphml(tmp_path / "faces.graphml", node_type=int, force_multigraph=True)
    assert read.nodes == faces.graph().nodes and len(read.edges) == len(faces.edges)
    for _, numbers in read.nodes(data=True):
        assert numbers["words"].startswith("plane, normal (")
        normal = [numbers[f"normal_{c}"] for c in "xyz"]
        assert abs(np.linalg.norm(normal) - 1.0) < 1e-12
    for _, _, numbers in read.edges(data=True):
        assert numbers["kind"].startswith("sharp") and abs(numbers["angle_deg"] - 90.0) < 0.2
    data = json.loads((tmp_path / "faces.json").read_text())
    again = nx.node_link_graph(data, edges="edges")
    assert sorted(map(sorted, again.edges())) == sorted(map(sorted, read.edges()))
    assert all(len(point) == 3 for edge in data["edges"] for c in edge["points"] for point in c)


def test_a_graphml_file_is_valid_by_its_schema(tmp_path):
    """xs:key and xs:NMTOKEN of graphml.xsd: ids are one in a file, and hold no blanks."""
    faces = faces_of("step")
    write_graphml(faces, tmp_path / "faces.graphml")
    root = ElementTree.parse(tmp_path / "faces.graphml").getroot()
    space = "{http://graphml.graphdrawing.org/xmlns}"
    ids = {k: [node.get("id") for node in root.iter(space + k)] for k in ("key", "node", "edge")}
    assert len(ids["edge"]) == len(faces.edges)
    for some in ids.values():
        assert len(some) == len(set(some))
        assert all(re.fullmatch(r"[-\w.:]+", name) for name in some)


@pytest.mark.parametrize("write", [write_graphml, write_json])
def test_what_is_no_faces_is_not_written(tmp_path, write):
    with pytest.raises(ValueError, match=r"got Atlas; give the Faces that Atlas.faces\(\) returns"):
        write(Atlas(0.1), tmp_path / "faces")
    with pytest.raises(ValueError, match="got NoneType for the path; give the path of a file"):
        write(Atlas(0.1).faces(), None)
    assert not list(tmp_path.iterdir())


def test_values_of_no_faces_and_at_no_points_are_refused():
    with pytest.raises(ValueError, match=r"got Atlas; give the Faces that Atlas.faces\(\) returns"):
        face_values(Atlas(0.1), np.zeros((1, 3)))
    for wrong in ([1.0, 2.0, 3.0], [[1.0, 2.0, np.nan]]):
        with pytest.raises(ValueError, match="points"):
            face_values(faces_of("step"), wrong)


def test_faces_are_shown_in_one_line():
    faces = faces_of("step")
    count = len(faces.points)
    shown = rf"<Faces: 8 faces, {len(faces.edges)} edges, \d+\.\d% of {count} samples unexplained>"
    assert re.fullmatch(shown, repr(faces))


def test_an_empty_atlas_has_no_faces(tmp_path):
    faces = Atlas(0.1).faces()
    assert len(faces) == 0 and faces.unexplained == 0.0
    write_graphml(faces, tmp_path / "faces.graphml")
    assert len(nx.read_graphml(tmp_path / "faces.graphml")) == 0


def test_samples_of_faces_and_those_without_are_all_samples():
    faces = faces_of("block")
    counted = sum(len(face.samples) for face in faces.faces)
    assert counted + np.count_nonzero(faces.of == -1) == len(faces.points)
    for face in faces.faces:
        assert (faces.of[face.samples] == face.id).all()


def test_the_field_of_no_face_is_refused():
    with pytest.raises(ValueError, match="there is no face; add touches"):
        face_values(Atlas(0.1).faces(), np.zeros((1, 3)))
