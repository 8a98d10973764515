"""Planes from straight runs of few samples, against bodies known in closed form."""

import numpy as np

from touchatlas.atlas.body.choose import shares_at_edges
from touchatlas.atlas.labels.samples import contour_samples
from touchatlas.atlas.labels.scan_lines import pairs_of_runs, straight_runs
from touchatlas.atlas.relabel.labelling import label_samples

STD, STEP = 0.02, 8.0


def sections(profile, outward):
    """Samples of three contours, in planes of constant y, of a body whose section is the same in
    all of them: points (n, 2) of x and z, and outward normals (n, 2)."""
    rng, count, every = np.random.default_rng(5), len(profile), []
    for y in (-15.0, 0.0, 15.0):
        every.append(np.column_stack([profile[:, 0], np.full(count, y), profile[:, 1]]))
    points = np.concatenate(every)
    points[:, [0, 2]] += STD * rng.normal(size=(len(points), 2))
    normals = np.column_stack([outward[:, 0], np.zeros(count), outward[:, 1]])
    planes = np.tile([0.0, 1.0, 0.0], (len(points), 1))
    numbers = np.repeat(np.arange(3), count)
    return contour_samples(points, np.tile(normals, (3, 1)), planes, STD, numbers=numbers)


def edge():
    """The sections of a sharp edge of two planes, x = 30 and z = 30, six samples on each."""
    at = STEP * np.arange(6) + 0.5 * STEP
    top = np.column_stack([30.0 - at[::-1], np.full(6, 30.0)])
    side = np.column_stack([np.full(6, 30.0), 30.0 - at])
    normals = np.repeat([[0.0, 1.0], [1.0, 0.0]], 6, axis=0)
    return sections(np.concatenate([top, side]), normals)


def cylinder():
    """The sections of a cylinder whose chord over a step leaves it by a quarter of a millimetre:
    twelve deviations."""
    radius = STEP**2 / (8.0 * 0.25)
    angle = STEP / radius * (np.arange(8) - 3.5)
    normals = np.column_stack([np.sin(angle), np.cos(angle)])
    return sections(radius * normals, normals)


def test_six_samples_a_side_show_both_planes_of_an_edge():
    """Beside an edge the parabola through five samples has another normal, so that a plane may be
    without the last two of each contour, 12 of 18 are its own. The mean of 12 is off by a third of
    a deviation, and its slope over 30 mm by a thousandth: five times as much is allowed."""
    labels = label_samples(edge())
    counts = np.bincount(labels.of[labels.of >= 0])
    assert len(counts) == 2 and (counts >= 12).all()
    pieces = sorted(labels.pieces, key=lambda piece: abs(piece.axes[2, 2]))
    for piece, axis in zip(pieces, np.eye(3)[[0, 2]], strict=True):
        assert abs(piece.axes[2] @ axis) > np.cos(5e-3)
        assert abs(piece.at(30.0 * axis[None])[0][0]) < 5.0 * STD


def test_runs_end_where_a_contour_turns():
    found = straight_runs(edge(), np.arange(12))
    assert sorted(len(run) for run in found) == [5, 6]
    assert all(run.max() < 6 or run.min() >= 6 for run in found)


def test_a_bent_surface_has_no_straight_runs():
    samples = cylinder()
    assert straight_runs(samples, np.arange(8)) == []
    assert pairs_of_runs(samples, np.ones(len(samples), bool)) == []


def test_short_contours_do_not_show_that_there_is_no_edge():
    """A contour of twelve samples shows no kink, be there an edge or none; one of forty does."""
    few = edge()
    none = np.zeros(len(few), bool)
    assert shares_at_edges(few, none, none) == (0.0, 1.0)
    line = np.column_stack([np.linspace(-30.0, 30.0, 40), np.full(40, 30.0)])
    many = sections(line, np.tile([0.0, 1.0], (40, 1)))
    none = np.zeros(len(many), bool)
    assert shares_at_edges(many, none, none) == (0.0, 0.0)
