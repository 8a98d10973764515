"""Revisions of labels: kinds of fewer parameters, and what is not tried again."""

import numpy as np
import pytest

from touchatlas.atlas.labels.grow import Evidence
from touchatlas.atlas.labels.labels import NONE, Labels
from touchatlas.atlas.labels.sample_graph import SampleGraph
from touchatlas.atlas.labels.samples import ContourSamples, contour_samples
from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.relabel.moves import join, refit

STD = 0.02
ACROSS = np.array([1.0, 0.0, 0.0])


def rows_of(height, count: int = 60) -> ContourSamples:
    """Contours along y over a square of 20, at the heights (m,) of points (m, 2)."""
    rng, y = np.random.default_rng(0), np.linspace(-10.0, 10.0, 41)
    points = []
    for x in np.linspace(-10.0, 10.0, count):
        flat = np.column_stack([np.full(len(y), x), y])
        points.append(np.column_stack([flat, height(flat) + STD * rng.normal(size=len(y))]))
    rows = np.concatenate(points)
    outward = np.broadcast_to([0.0, 0.0, 1.0], rows.shape)
    # Planes that differ part one contour from the next.
    turn = np.repeat(1e-6 * np.arange(count), len(y))
    planes = ACROSS + turn[:, None] * np.array([0.0, 0.0, 1.0])
    return contour_samples(rows, outward, planes / np.linalg.norm(planes, axis=1)[:, None], STD)


def labels_of(samples: ContourSamples, kind: Kind) -> Labels:
    """All samples with one label of a kind."""
    labels = Labels(Evidence(samples, SampleGraph(samples)))
    everyone = np.arange(len(samples))
    labels.add(fit_piece(kind, samples.points, samples.normals, STD), everyone)
    return labels


@pytest.mark.parametrize(
    ("sagitta", "kind"), [(0.0, Kind.PLANE), (0.01, Kind.PLANE), (0.3, Kind.CYLINDER)]
)
def test_a_face_bent_by_less_than_its_samples_show_is_a_plane(sagitta, kind):
    """A cylinder of sagitta 0.01 is off a plane by 0.003 in root mean square (a parabola of
    height h by 0.3 h): 0.15 deviations, where 0.25 are borne."""
    labels = labels_of(rows_of(lambda at: -sagitta * (at[:, 1] / 10.0) ** 2), Kind.QUADRIC)
    refit(labels)
    assert labels.pieces[0].kind is kind


@pytest.mark.parametrize(("rows", "kept"), [(2, True), (0.25, False)])
def test_a_part_of_many_samples_stays_a_face_where_a_label_falls_apart(rows, kept):
    """Two contours of 41 samples are 3 in a hundred of all, and a quarter of one is too few."""
    labels = labels_of(rows_of(lambda at: 0.0 * at[:, 0]), Kind.PLANE)
    part = np.arange(int(41 * rows))
    # A band of five contours, over which no link leads.
    labels.of[len(part) : len(part) + 5 * 41] = NONE
    labels.separate()
    assert labels.of[-1] == 0
    assert (labels.of[part] == (1 if kept else NONE)).all()


def halves_of(samples: ContourSamples) -> Labels:
    """A plane for the samples on each side of y = 0."""
    labels = Labels(Evidence(samples, SampleGraph(samples)))
    for side in (samples.points[:, 1] < 0.0, samples.points[:, 1] >= 0.0):
        own = np.flatnonzero(side)
        piece = fit_piece(Kind.PLANE, samples.points[own], samples.normals[own], STD)
        labels.add(piece, own)
    return labels


def test_an_edge_is_refused_by_the_most_general_kinds(monkeypatch):
    """Two planes at 90 degrees are one quadric, but an edge. No sphere, cylinder or cone, each of
    which is a quadric, too, is fitted to both."""
    labels, fitted = halves_of(rows_of(lambda at: -np.abs(at[:, 1]))), []
    fit = Evidence.fit
    monkeypatch.setattr(Evidence, "fit", lambda *own: fitted.append(own[1]) or fit(*own))
    assert join(labels) == 0
    assert set(fitted) == {Kind.QUADRIC, Kind.QUARTIC}


def test_halves_of_a_cylinder_are_joined():
    labels = halves_of(rows_of(lambda at: np.sqrt(20.0**2 - at[:, 1] ** 2)))
    assert join(labels) == 1
    labels.drop_empty()
    assert [piece.kind for piece in labels.pieces] == [Kind.CYLINDER]
