"""The cubes of a closed atlas leave no hole."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from tests.explored import explored
from touchatlas.atlas import extract_surface
from touchatlas.atlas.mesh.coarse_mesh import coarse_mesh
from touchatlas.atlas.mesh.marching_cubes import corners_of, key
from touchatlas.atlas.mesh.narrow_band import Corners, extend
from touchatlas.planner import explore
from touchatlas.sim import Probe, make_object
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.run.work import begin, random_streams


def test_coarse_meshes_of_a_closed_atlas_are_closed_on_every_lattice():
    """Where a patch owns few corners of a cube, its signs are known last; its neighbours, too, must
    be there."""
    field = explored("torus").atlas.field
    for edge in np.linspace(2.0, 6.0, 30):
        mesh = coarse_mesh(field, float(edge))
        found = trimesh.Trimesh(mesh.vertices.points, mesh.faces, process=False)
        assert found.is_watertight and found.euler_number == 0, edge


def test_a_corner_that_no_patch_owns_is_of_the_patch_in_whose_cell_it_lies():
    """Not of the one that is nearest there: far from its core a polynomial has other zeros. One
    such zero drew a hole of 10 mm into a blob."""
    cube = np.array([key(np.zeros(3, np.int64))])
    keys = np.unique(corners_of(cube))
    owners = np.array([0, 1, -1, -1, -1, -1, -1, -1])
    corners = Corners(keys, np.where(owners < 0, np.nan, 1.0), owners)
    near, far = [0.0, 0.0, -2.0], [30.0, 0.0, 0.0]
    table = SimpleNamespace(
        size=2,
        site=np.array([near, far]),
        weight=np.array([9.0, 9.0]),
        radius=np.ones(2),
        scaled_local=lambda rows, points: np.zeros((len(rows), 1, 3)),
    )

    def distances(rows, points, plain):
        return np.where(rows == 0, 2.0, 0.1), None, None

    field = SimpleNamespace(table=table, distances=distances)
    at = corners.at(corners_of(cube))
    found = extend(field, at, corners, np.zeros(3), 1.0)
    assert (found.owners[2:] == 0).all() and (found.values[2:] == 2.0).all()


@pytest.mark.parametrize("tolerance", [0.01, 0.001])
def test_a_finished_atlas_of_few_touches_has_no_hole(tolerance):
    """Eight and ten touches know all of this blob. Corners deep inside it were taken for outside,
    by other zeros of patches that are as large as a fifth of it, and its surface had holes."""
    body = make_object("blob", 1)
    rngs = random_streams(1)
    atlas, planner = begin(
        RunOptions(body.noise_std, tolerance * body.diagonal, seed=1), body, rngs[3]
    )
    assert len(list(explore(atlas, planner, Probe(body, body.noise_std, rngs[0])))) < 20
    atlas.finish()
    surface = extract_surface(atlas)
    found = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert found.is_watertight and found.euler_number == 2
