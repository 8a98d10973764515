"""The surface is drawn among its samples: half-touched bodies have no flaps."""

import numpy as np
import pytest

from tests.explored import explored
from tests.sharp import explored_sharp, sharp_object
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.support import among_samples
from touchatlas.atlas.surface import extract_surface
from touchatlas.sim.triangles import areas_of


def half(touches, tolerance: float, side: int) -> Atlas:
    """The atlas of the touches on one side of the middle."""
    atlas = Atlas(tolerance)
    for touch in touches:
        if touch.contact[side] > 0.0:
            atlas.add(touch)
    atlas.settle()
    return atlas


@pytest.mark.parametrize(("name", "side"), [("cube", 0), ("wall", 1)])
def test_half_touched_bodies_with_edges_have_no_flaps(name, side):
    """A face whose neighbour was not touched ends at its samples, with no crease to end it: nothing
    lies farther than three tolerances off the body, where flaps were 0.4 % of the wall's."""
    atlas, obj = half(explored_sharp(name).touches, 0.1, side), sharp_object(name)
    for change in (Atlas.settle, Atlas.simplify):
        change(atlas)
        surface = extract_surface(atlas)
        areas = areas_of(surface.vertices, surface.faces)
        off = np.abs(obj.value(surface.vertices[surface.faces].mean(axis=1)))
        assert areas @ (off > 0.3) <= 1e-3 * areas.sum()


def test_among_samples_is_within_their_hull():
    """Samples themselves are; places a little farther out than the farthest are not."""
    atlas = half(explored("sphere").touches, 0.1, 0)
    table, learning = atlas.table, atlas.learning
    row = int(table.rows[table.ring_open[table.rows].any(axis=1)][0])
    points = learning.pool.points[learning.members[row]]
    assert among_samples(atlas, np.full(len(points), row), points).all()
    along = (points - table.origin[row]) @ table.axes[row, 0]
    farther = points[along.argmax()] + 0.01 * table.radius[row] * table.axes[row, 0]
    assert not among_samples(atlas, np.array([row]), farther[None]).any()


def test_whole_objects_are_asked_nothing():
    """No outline is bare: far from all samples, too, the answer is yes."""
    atlas = explored("sphere").atlas
    far = np.full((1, 3), 1e3)
    assert among_samples(atlas, atlas.table.rows[:1], far).all()


def test_trusted_surface_lies_among_samples():
    """Past the last samples of a patch a polynomial may go on as if the body did: every point has
    samples that face as it does on both sides of any line through it."""
    atlas = explored("torus", max_touches=60).atlas
    surface, pool = extract_surface(atlas), atlas.learning.pool
    some = np.linspace(0, len(surface.vertices) - 1, 400).astype(int)
    angles = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    for point, normal, row in zip(
        surface.vertices[some], surface.normals[some], surface.patch[some], strict=True
    ):
        radius = atlas.table.radius[row]
        offset = pool.points - point
        near = ((offset * offset).sum(axis=1) <= (2.0 * radius) ** 2) & (pool.normals @ normal > 0)
        first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
        first /= np.linalg.norm(first)
        turned = np.stack([first, np.cross(normal, first)])
        along = np.column_stack([np.cos(angles), np.sin(angles)]) @ turned
        # But for 1 % of the radius, and what the surface bends from the patch's centre to there.
        assert (offset[near] @ along.T).max(axis=0).min() >= -0.05 * radius
