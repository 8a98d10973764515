"""Flat sheets without noise are drawn, whatever plane of the lattice they lie in."""

import numpy as np
import pytest

from tests.flat import flat_touch
from touchatlas.atlas import Atlas, extract_surface


@pytest.mark.parametrize("edge", [None, 0.2])
@pytest.mark.parametrize("normal", [*np.eye(3), *-np.eye(3)])
def test_a_flat_sheet_without_noise_is_drawn_in_every_plane_of_the_lattice(normal, edge):
    """The lattice begins at the origin of the first patch, so the whole sheet lies between two
    layers of cubes. The contours' ends lie on a circle of radius 1; the surface ends near the
    hexagon of area 2.6 between them."""
    atlas = Atlas(0.01)
    first = np.roll(np.abs(normal), 1)
    atlas.add(flat_touch(np.zeros(3), normal, first, 0.0, np.random.default_rng(0)))
    surface = extract_surface(atlas, edge)
    corners = surface.vertices[surface.faces]
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ normal
    assert (area > 0.0).all() and 1.3 < area.sum() < np.pi
    assert surface.vertices @ normal == pytest.approx(np.zeros(len(surface.vertices)), abs=1e-9)
