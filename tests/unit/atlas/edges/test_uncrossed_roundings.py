"""Roundings over which no contour runs across: what lies along them shows them."""

import numpy as np
import pytest

from tests.lawful import BLUNT, HALF, NOISE, rounded_box_distance
from touchatlas.atlas.edges import blunt_edges, crossings
from touchatlas.atlas.edges.blunt_edges import Rounding
from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.labels.options import FaceOptions
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import contour_samples
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.relabel.absorb import absorb

FRONT, RIGHT, TOP = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], float)


def _over_an_edge(first, second) -> tuple[np.ndarray, ...]:
    """Points (24, 3), normals, and those of the plane, of a contour over the rounded edge of two
    sides of the box, 7 from a corner with FRONT or RIGHT."""
    across = np.cross(first, second)
    angle = np.linspace(0.0, 0.5 * np.pi, 6)
    away = 1.5 * np.arange(9, 0, -1)
    on_ball = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    normals = np.concatenate([np.tile(first, (9, 1)), on_ball, np.tile(second, (9, 1))])
    back = np.concatenate([np.outer(away, second), np.zeros((6, 3)), np.outer(away[::-1], first)])
    third = (RIGHT if abs(across @ RIGHT) > 0.5 else FRONT) * (HALF - 7.0)
    middle = (HALF - BLUNT) * (first + second) + third
    return middle + BLUNT * normals - back, normals, np.tile(across, (24, 1))


def _along_the_edge() -> tuple[np.ndarray, ...]:
    """The same of a contour along the edge of FRONT and RIGHT, from ball to ball of its corners."""
    angle = np.linspace(-1.2, 1.2, 12)[:, None]
    outward = (FRONT + RIGHT) / np.sqrt(2.0)
    ball = np.cos(angle) * outward + np.sin(angle) * TOP
    normals = np.concatenate([ball[:6], np.tile(outward, (20, 1)), ball[6:]])
    height = np.concatenate([np.full(6, -1.0), np.linspace(-1.0, 1.0, 20), np.full(6, 1.0)])
    middle = (HALF - BLUNT) * (FRONT + RIGHT + height[:, None] * TOP)
    return middle + BLUNT * normals, normals, np.tile(np.cross(TOP, outward), (32, 1))


@pytest.fixture
def box():
    """Labels of a rounded box: contours run over the edges of its top and its bottom with two of
    its sides. Over the edge of these sides none runs across, but one along it; its 32 samples are
    the last, and have no label."""
    pairs = [(side, end) for side in (FRONT, RIGHT) for end in (TOP, -TOP)]
    parts = [*(_over_an_edge(*pair) for pair in pairs), _along_the_edge()]
    points, normals, across = map(np.concatenate, zip(*parts, strict=True))
    assert np.abs(rounded_box_distance(points)).max() < 1e-9
    points += NOISE * np.random.default_rng(0).normal(size=(len(points), 1)) * normals
    samples = contour_samples(points, normals, across, NOISE)
    labels = Labels(Evidence(samples, SampleGraph(samples), FaceOptions()))
    for side in (FRONT, RIGHT, TOP, -TOP):
        members = np.flatnonzero(normals @ side > 1.0 - 1e-9)
        labels.add(labels.evidence.fit(Kind.PLANE, members), members)
    return labels


def test_a_piece_over_an_edge_and_the_corners_at_its_ends_is_given_up(box):
    """All samples of the contour along the edge are of one piece. No edge that is known explains
    these. The balls that touch the four faces do."""
    members = np.arange(len(box.of) - 32, len(box.of))
    box.add(box.evidence.fit(Kind.QUADRIC, members), members)
    assert absorb(box) == 1
    assert np.all(box.of[members] == NONE)


def test_samples_on_a_ball_show_an_edge_that_no_contour_crosses(box):
    """The radius is within four of its deviations; two faces that are parallel have no edge."""
    edges = {(edge.first, edge.second): edge for edge in Rounding(box).edges}
    assert sorted(edges) == [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3)]
    assert abs(edges[0, 1].radius - BLUNT) < 4.0 * edges[0, 1].deviation
    # 20 samples between the corners, 12 on the balls of these.
    assert 20 <= len(edges[0, 1].samples) <= 32


def test_a_row_far_from_all_faces_shows_no_edge(box, monkeypatch):
    """No face is within a chord that is shorter than the step of the contours."""
    monkeypatch.setattr(crossings, "longest_chord", lambda _: 1e-3 * BLUNT)
    assert not crossings.find_crossings(box)


def test_a_rounding_wider_than_the_longest_chord_is_none(box, monkeypatch):
    """The ball of radius r touches the sides of a right angle √2 r apart. Balls as wide as a body
    touch most of its faces, and nearly all of them explain some of a piece. Samples to come make
    the chord longer: what was found with another one does not count."""
    for share, edges in ((0.9, 0), (1.1, 5), (0.9, 0)):
        chord = share * np.sqrt(2.0) * BLUNT
        monkeypatch.setattr(blunt_edges, "longest_chord", lambda _, chord=chord: chord)
        assert len(Rounding(box).edges) == edges
