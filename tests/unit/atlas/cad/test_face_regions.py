"""Regions of labelled triangles: loops that close, chains between two regions."""

import numpy as np
import pytest
import trimesh

from touchatlas.atlas.cad.face_regions import BEYOND, regions_of


def cube():
    """Triangles of a cube, and a label for each side."""
    mesh = trimesh.creation.box((2.0, 2.0, 2.0)).subdivide().subdivide().subdivide()
    axis = np.abs(mesh.face_normals).argmax(axis=1)
    return mesh, 2 * axis + (mesh.triangles_center[np.arange(len(axis)), axis] > 0)


def ends(regions, loop):
    """Start and end vertices of the chains of a loop, as they are followed."""
    found = [(regions.chains[c].vertices[[0, -1]], forward) for c, forward in loop]
    return [tuple((pair if forward else pair[::-1]).tolist()) for pair, forward in found]


def test_a_cube_has_six_regions_twelve_chains_and_eight_nodes():
    mesh, labels = cube()
    regions = regions_of(mesh.faces, labels)
    assert len(regions.labels) == 6 and len(regions.chains) == 12
    assert len({int(v) for c in regions.chains for v in c.vertices[[0, -1]]}) == 8
    for loops in regions.loops:
        assert [len(loop) for loop in loops] == [4]


def test_loops_close_and_each_chain_is_followed_once_each_way():
    mesh, labels = cube()
    regions = regions_of(mesh.faces, labels)
    for loops in regions.loops:
        for loop in loops:
            steps = ends(regions, loop)
            assert [b for _, b in steps] == [a for a, _ in steps[1:] + steps[:1]]
    uses = sorted(use for loops in regions.loops for loop in loops for use in loop)
    assert uses == [(c, way) for c in range(12) for way in (False, True)]


def test_the_region_is_on_the_left_of_its_loops():
    """Seen from outside, a loop turns counter-clockwise: its area vector is the outward normal
    times the area of the side, 4."""
    mesh, labels = cube()
    regions = regions_of(mesh.faces, labels)
    for region, ((loop,), label) in enumerate(zip(regions.loops, regions.labels, strict=True)):
        parts = [regions.chains[c].vertices[:: 1 if way else -1][:-1] for c, way in loop]
        points = mesh.vertices[np.concatenate(parts)]
        area = 0.5 * np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
        outward = (2.0 * (label % 2) - 1.0) * np.eye(3)[label // 2]
        assert area == pytest.approx(4.0 * outward, abs=1e-12), region


def test_specks_and_teeth_take_the_label_around_them():
    mesh, labels = cube()
    inner = np.flatnonzero((labels == 0) & (np.abs(mesh.triangles_center[:, 1:]).max(axis=1) < 0.4))
    speckled = labels.copy()
    speckled[inner[:2]] = 3
    regions = regions_of(mesh.faces, speckled)
    assert np.array_equal(regions.labels[regions.of], labels)


def test_a_band_has_two_loops_and_a_hole_has_a_rim():
    """The belt of a cylinder is closed by its caps; without one of them it ends at a rim."""
    mesh = trimesh.creation.cylinder(1.0, 2.0, sections=32).subdivide().subdivide()
    z = mesh.face_normals[:, 2]
    labels = np.where(np.abs(z) < 0.5, 0, np.where(z > 0, 1, 2))
    regions = regions_of(mesh.faces, labels)
    belt = int(np.flatnonzero(regions.labels == 0)[0])
    assert len(regions.loops[belt]) == 2 and len(regions.chains) == 2
    for chain in regions.chains:
        assert chain.vertices[0] == chain.vertices[-1] and chain.right != BEYOND
    open_ = regions_of(mesh.faces[labels != 1], labels[labels != 1])
    assert sorted(chain.right == BEYOND for chain in open_.chains) == [False, True]
