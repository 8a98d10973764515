"""Blunt edges: a radius for each edge that is rounded, found from contours that run over it."""

from itertools import product

import numpy as np
import pytest

from tests.lawful import NOISE, faces_before_last, known_body, rounded_box_distance
from tests.lawful_meshes import BLUNT, FILLET, HALF, lawful_object
from touchatlas.atlas.body.thinned_samples import ThinnedSamples
from touchatlas.atlas.body.uncrossed_edges import with_uncrossed_edges
from touchatlas.atlas.edges.blunt_edges import needless_labels
from touchatlas.atlas.edges.boundary import EdgeKind
from touchatlas.atlas.faces.face_graph import as_networkx
from touchatlas.atlas.labels.tried import NEW, NONE, Tried
from touchatlas.atlas.relabel.labelling import relabel
from touchatlas.atlas.relabel.moves import give_to_roundings


@pytest.fixture(scope="module")
def rounded():
    return known_body("rounded", 34)


def test_a_rounded_box_is_six_planes_and_one_radius_for_each_edge(rounded):
    """Twelve edges, each with a radius within four of its deviations, as 1 of 16,000 is not; the
    chords of the mesh are 6e-4 radii too low."""
    assert [face.kind for face in rounded.faces.faces] == 6 * ["plane"]
    edges = rounded.faces.edges
    assert len(edges) == 12 and {e.kind for e in edges} == {EdgeKind.SHARP_CONVEX}
    for edge in edges:
        assert abs(edge.radius - BLUNT) < 4.0 * edge.radius_std + 1e-3 * BLUNT
        assert edge.radius_std < 0.03 * BLUNT


def test_samples_on_rounded_edges_are_explained(rounded):
    """All but those of corners that no three edges with a radius explain, 1 of 100."""
    assert rounded.faces.are_lawful
    assert rounded.faces.unexplained < 0.02


def test_samples_on_rounded_edges_and_corners_count_as_the_surface(rounded):
    """Those about a place tell whether it is known. Without them 13 more touches were made on a box
    whose roundings were a fourth of its height, though faces and radii were known."""
    faces = rounded.faces
    seeds = {point.tobytes() for point in ThinnedSamples(faces.points, faces, NOISE).points}
    kept = np.array([point.tobytes() in seeds for point in faces.points])
    explained = faces.of >= 0
    explained[faces.rounded] = True
    assert kept[faces.rounded].mean() > 0.9
    assert not kept[~explained].any()


def test_new_samples_on_a_known_rounding_start_no_piece(rounded):
    """Two touches more: their samples on known balls are explained from the start, and there are
    as many pieces as before."""
    faces = faces_before_last("rounded", 34)
    again = relabel(rounded.samples, faces)
    new = np.arange(len(faces.of), len(rounded.samples))
    on_balls = np.intersect1d(new, rounded.faces.rounded)
    assert len(on_balls) > 10
    assert again.rounded[on_balls].mean() > 0.7
    assert len(again.pieces) == len(faces.pieces)


def test_a_label_is_offered_to_an_edge_again_only_where_labels_have_changed(rounded):
    """Each face of a box lies beside the edges of others. A tenth of its samples may leave a label
    that counts as the same."""
    labels = relabel(rounded.samples, rounded.faces)
    labels.given = Tried(np.full(len(labels.of), NEW))
    assert {label for _, label in needless_labels(labels)} == set(range(6))
    assert give_to_roundings(labels) == 0
    assert not list(needless_labels(labels))
    members = labels.members(0)
    labels.of[members[: len(members) // 8]] = NONE
    offers = [(edge.first, edge.second, label) for edge, label in needless_labels(labels)]
    assert offers and all(0 in offer for offer in offers)


def test_the_field_of_a_rounded_box_is_that_of_its_balls(rounded):
    """Half of the noise bounds the error of planes and radii that hundreds of samples fit; near
    corners that few touches met, one point of 100 may be given to one plane alone."""
    rng = np.random.default_rng(0)
    surface, normals = lawful_object("rounded").sample(3000, rng)
    points = surface + rng.uniform(-0.5, 0.5, (3000, 1)) * normals
    found, known = rounded.at(points)
    assert known.mean() > 0.97
    error = np.abs(found.distance - rounded_box_distance(points))[known]
    assert (error > 0.5 * NOISE).mean() < 0.02


def test_roundings_go_on_to_corners_where_a_third_face_has_the_nearest_sample(rounded):
    """On the balls of all corners and the ends of all edges the field is zero, to a tenth of the
    radius where three planes and three radii err by a few hundredths of it."""
    rng = np.random.default_rng(0)
    outward = np.abs(rng.normal(size=(400, 3)))
    outward[100:, :] *= np.repeat(1.0 - np.eye(3), 100, axis=0)
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    back = np.where(outward == 0.0, rng.uniform(0.0, 3.0, (400, 3)), 0.0)
    first = HALF - BLUNT + BLUNT * outward - back
    points = np.concatenate([first * s for s in product((-1.0, 1.0), repeat=3)])
    assert rounded_box_distance(points) == pytest.approx(0.0, abs=1e-12)
    assert np.abs(rounded.field.at(points).distance).max() < 0.1 * BLUNT


def test_the_edges_of_a_sharp_box_have_no_radius():
    edges = with_uncrossed_edges(known_body("box", 40)).edges
    assert len(edges) == 12 and all(edge.radius == 0.0 for edge in edges)


def test_a_bevel_is_a_plane_and_no_rounding():
    """No ball explains the samples at the middle and at the ends of a bevel alike."""
    faces = known_body("bevelled", 40).faces
    assert all(edge.radius == 0.0 for edge in faces.edges)
    assert sum(face.kind == "plane" for face in faces.faces) > 6


@pytest.mark.slow
def test_a_concave_edge_has_a_radius_too():
    """One edge of a step is filleted; the radius is within four of its deviations."""
    edges = known_body("filleted", 40).faces.edges
    concave = [edge for edge in edges if edge.kind is EdgeKind.SHARP_CONCAVE]
    assert len(concave) == 1
    assert abs(concave[0].radius - FILLET) < 4.0 * concave[0].radius_std + 1e-3 * FILLET
    assert all(edge.radius == 0.0 for edge in edges if edge is not concave[0])


def test_the_graph_tells_the_radius_of_an_edge(rounded):
    graph = as_networkx(rounded.faces)
    radii = [data["radius"] for *_, data in graph.edges(data=True)]
    assert radii == [edge.radius for edge in rounded.faces.edges]
