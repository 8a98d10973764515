"""Real meshes, from the folder TOUCHATLAS_OBJECTS; tests of them are skipped where it is absent."""

import os
from pathlib import Path

import pytest

from touchatlas.sim.world.mesh_object import MeshObject
from touchatlas.sim.world.objects import make_object

FOLDER = Path(
    os.environ.get("TOUCHATLAS_OBJECTS", Path(__file__).parents[2] / "shared" / "objects")
)


def real_mesh(name: str) -> MeshObject:
    """An object of the folder; skips the test without it."""
    path = FOLDER / f"{name}.ply"
    if not path.is_file():
        pytest.skip(f"no {path.name} in the folder TOUCHATLAS_OBJECTS")
    return make_object(str(path))
