"""Curved triangles: their topology, and their order on an ellipsoid."""

import numpy as np
import pytest
import trimesh

from touchatlas.atlas.mesh.extract import mean_height
from touchatlas.atlas.mesh.pn_triangles import Subdivision


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_curved_triangles_fit_their_neighbours(count):
    coarse = trimesh.creation.icosphere(subdivisions=1)
    vertices, faces = np.array(coarse.vertices), np.array(coarse.faces)
    cut = Subdivision(len(vertices), faces, count)
    points = cut.points(vertices, vertices)
    fine = trimesh.Trimesh(points, cut.faces(), process=False)
    assert fine.is_watertight and fine.is_winding_consistent and fine.euler_number == 2
    assert len(fine.faces) == count**2 * len(faces) and len(points) == len(cut.linear(vertices))
    new = np.arange(len(vertices), len(points))
    distance = np.linalg.norm(points[new, None] - vertices[cut.parents(new)], axis=2)
    assert (
        distance.max(initial=0.0) <= np.linalg.norm(np.diff(coarse.triangles, axis=1), axis=2).max()
    )


def test_labels_are_shared_where_all_old_vertices_have_them():
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    cut = Subdivision(4, faces, 4)
    labels = np.array([5, 5, 5, 7])
    new = np.arange(4, len(cut.linear(labels)))
    around = labels[cut.parents(new)]
    expected = np.where((around == around[:, :1]).all(axis=1), around[:, 0], -1)
    assert cut.shared(labels)[:4].tolist() == labels.tolist()
    assert (cut.shared(labels)[4:] == expected).all() and set(expected.tolist()) == {5, -1}


def test_curved_triangles_are_of_fourth_order():
    """Half the edges leave a sixteenth of the error, on an ellipsoid of three axes."""
    axes, errors = np.array([1.0, 0.7, 0.5]), []
    for level in (2, 3, 4):
        coarse = trimesh.creation.icosphere(subdivisions=level)
        vertices = np.array(coarse.vertices) * axes
        normals = vertices / axes**2
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        cut = Subdivision(len(vertices), np.array(coarse.faces), 4)
        points = cut.points(vertices, normals)
        level_set = ((points / axes) ** 2).sum(axis=1) - 1.0
        errors.append(np.abs(level_set / np.linalg.norm(2.0 * points / axes**2, axis=1)).mean())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.7).all()


@pytest.mark.parametrize("count", [1, 3])
def test_triangles_moved_out_by_their_mean_height_lie_about_the_surface(count):
    """About an ellipsoid, whose inscribed triangles all lie inside: the mean is left with the
    fourth order of their size, of which the heights themselves are the second."""
    axes = np.array([1.0, 0.7, 0.5])
    coarse = trimesh.creation.icosphere(subdivisions=4)
    vertices = np.array(coarse.vertices) * axes
    normals = vertices / axes**2
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    cut = Subdivision(len(vertices), np.array(coarse.faces), count)
    heights = mean_height(cut.edges, vertices, normals, count)
    directions = cut.linear(normals)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    points, volume = cut.points(vertices, normals), np.pi * 4.0 / 3.0 * axes.prod()
    flat, moved = (
        trimesh.Trimesh(p, cut.faces(), process=False).volume / volume - 1.0
        for p in (points, points + cut.linear(heights)[:, None] * directions)
    )
    assert flat < 0.0 and abs(moved) < 0.02 * abs(flat)
