"""The catalogue of built-in objects, in millimetres, and the way from a name to an object."""

import difflib
import hashlib
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np

from touchatlas.patch.entry_points import OBJECTS, added, load_added
from touchatlas.sim.world.implicit_fields import (
    bottle,
    polyhedron,
    quadric_with_bumps,
    rounded_box,
    torus,
)
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject

# A hand-sized object touched by an arm that is good to 0.02 mm, as in the paper.
_NOISE, _TOLERANCE = 0.02, 0.1
# Triangles of a box whose corner x, y, z has the number 4 x + 2 y + z.
_BOX = np.array(
    [
        *([1, 3, 0], [4, 1, 0], [0, 3, 2], [2, 4, 0], [1, 7, 3], [5, 1, 4]),
        *([5, 7, 1], [3, 7, 2], [6, 4, 2], [2, 7, 6], [6, 5, 4], [7, 5, 6]),
    ]
)


def _blob(seed: int) -> ImplicitObject:
    rng = np.random.default_rng(seed)
    radius, count = 35.0, 14
    centres = rng.normal(size=(count, 3))
    centres *= radius / np.linalg.norm(centres, axis=1)[:, None]
    widths = rng.uniform(9.0, 15.0, count)
    field = quadric_with_bumps((radius,) * 3, centres, widths, rng.uniform(-0.25, 0.2, count))
    return ImplicitObject(
        "blob", "a ball with seeded bumps and dents", field, (45.0,) * 3, _NOISE, _TOLERANCE
    )


def _mouse(seed: int) -> ImplicitObject:
    centres = [[-18, 27, 8], [-14, -29, 4], [42, 0, 20], [-30, 4, 17], [5, 2, -22], [50, 18, -4]]
    widths = [15.0, 17.0, 16.0, 20.0, 26.0, 14.0]
    depths = [0.32, 0.24, 0.16, -0.28, 0.3, -0.14]
    field = quadric_with_bumps((57.0, 31.0, 19.0), centres, widths, depths)
    return ImplicitObject(
        "mouse",
        "smooth, asymmetric, hand-sized, convex and concave",
        field,
        (64.0, 36.0, 26.0),
        _NOISE,
        _TOLERANCE,
    )


def _cube(seed: int) -> ImplicitObject:
    half = (30.0,) * 3
    vertices = np.array(list(product((-30.0, 30.0), repeat=3)))
    field = polyhedron(np.kron(np.eye(3), [[1.0], [-1.0]]), np.repeat(half, 2))
    return ImplicitObject(
        *("cube", "60 x 60 x 60, sharp", field, half, _NOISE, _TOLERANCE),
        triangles=(vertices, _BOX),
    )


def _simple(name, description, field, half_extent, scale=1.0, chi=2):
    return lambda seed: ImplicitObject(
        name, description, field, half_extent, _NOISE * scale, _TOLERANCE * scale, chi
    )


_CATALOGUE: dict[str, Callable[[int], ImplicitObject]] = {
    "sphere": _simple(
        "sphere", "ball of radius 33, the paper's", quadric_with_bumps((33.0,) * 3), (33.0,) * 3
    ),
    "ellipsoid": _simple(
        "ellipsoid", "half axes 80, 50, 30", quadric_with_bumps((80.0, 50.0, 30.0)), (80, 50, 30)
    ),
    "ellipsoid_paper": _simple(
        "ellipsoid_paper",
        "half axes 8, 5, 3, the paper's",
        quadric_with_bumps((8.0, 5.0, 3.0)),
        (8, 5, 3),
        0.1,
    ),
    "torus": _simple("torus", "radii 40 and 15", torus(40.0, 15.0), (55, 55, 15), chi=0),
    "bottle": _simple(
        "bottle",
        "surface of revolution with a neck of negative Gaussian curvature",
        bottle(32.0, 13.0, 90.0, 38.0, 20.0),
        (33, 33, 90),
    ),
    "mouse": _mouse,
    "blob": _blob,
    "plate": _simple(
        "plate",
        "100 x 60 x 20 with fillets of radius 5",
        rounded_box((50.0, 30.0, 10.0), 5.0),
        (50, 30, 10),
    ),
    "cube": _cube,
}


def object_names() -> list[str]:
    """Names of the built-in objects, and of those that other packages add."""
    return [*_CATALOGUE, *(name for name in added(OBJECTS) if name not in _CATALOGUE)]


def make_object(name: str, seed: int = 0) -> ImplicitObject | MeshObject:
    """The built-in object of a name, or the mesh in a file.

    A package adds an object to ``touchatlas.objects`` as a function of a seed to vertices (v, 3)
    and faces (f, 3).

    Parameters
    ----------
    name : str
    seed : int
        Of the objects that are random (blob).

    Raises
    ------
    ValueError
        Neither a built-in name nor a readable mesh file.
    """
    if name in _CATALOGUE:
        return _CATALOGUE[name](seed)
    if name in added(OBJECTS):
        obj = MeshObject(name, *load_added(OBJECTS, name)(seed))
        obj.source = name
        return obj
    if Path(name).is_dir():
        raise ValueError(f"{name!r} is a folder; give a mesh file in it, or a built-in object")
    if Path(name).exists() and not Path(name).is_file():
        raise ValueError(f"{name!r} is a device or a pipe; give a mesh file, or a built-in object")
    if not Path(name).is_file():
        near = difflib.get_close_matches(name, object_names(), 1)
        hint = f"; did you mean {near[0]}?" if near else "; give one of these, or a file"
        raise ValueError(
            f"there is no file {name!r}, nor a built-in object ({', '.join(object_names())}){hint}"
        )
    # Reading meshes takes trimesh, which built-in objects do without.
    from touchatlas.sim.world.mesh_file import read_mesh

    file = read_mesh(name)
    obj = MeshObject(Path(name).stem, file.vertices, file.faces)
    obj.unit, obj.notes = file.unit, [*file.notes, *obj.notes]
    obj.source = str(Path(name).resolve())
    return obj


def file_digest(path) -> str:
    """SHA-256 of the bytes of a file."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def digest_of(obj: ImplicitObject | MeshObject) -> str | None:
    """SHA-256 of the triangles of a mesh; None for a built-in object."""
    if not isinstance(obj, MeshObject):
        return None
    return hashlib.sha256(obj.vertices.tobytes() + obj.faces.tobytes()).hexdigest()
