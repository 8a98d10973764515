"""Region: the part of space in which the surface is wanted; what lies outside costs nothing."""

from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from pathlib import Path

import numpy as np

from touchatlas.atlas.check.doubt import NOWHERE, Doubt

_WANTED = "give box:X,Y,Z,X,Y,Z (two corners), ball:X,Y,Z,RADIUS, or the path of a closed mesh"
# Files of which trimesh makes triangles in metres, whatever unit they name.
_IN_METRES = (".step", ".stp")


@dataclass(frozen=True, eq=False)
class Region:
    """A box, a ball or the inside of a closed mesh.

    Parameters
    ----------
    text : str
        As it is written.
    numbers : (6,) or (4,) float, length
        Two corners of a box, or centre and radius of a ball; none of a mesh.
    mesh : Trimesh, optional
    """

    text: str
    numbers: np.ndarray
    mesh: object | None = None

    def distance(self, points) -> np.ndarray:
        """(n,) distance of points (n, 3) from the region, length; 0 inside of it.

        >>> region_of("ball:0,0,0,2").distance(np.array([[1.0, 0, 0], [5, 0, 0]])).tolist()
        [0.0, 3.0]
        """
        points = np.reshape(points, (-1, 3))
        if not len(points):
            return np.zeros(0)
        if len(self.numbers) == 4:
            away = np.sqrt(((points - self.numbers[:3]) ** 2).sum(axis=1)) - self.numbers[3]
            return np.maximum(away, 0.0)
        if len(self.numbers) == 6:
            low, high = self.numbers[:3], self.numbers[3:]
            off = np.maximum(np.maximum(low - points, points - high), 0.0)
            return np.asarray(np.sqrt((off * off).sum(axis=1)))
        return np.maximum(_signed_distance(self.mesh, points), 0.0)


def region_of(text: str) -> Region:
    """The region that a text names.

    Raises
    ------
    ValueError
        When it names none.

    >>> region_of("box:0,0,0,1,2,3").distance([[0.5, 0.5, 5.0]]).tolist()
    [2.0]
    """
    kind, _, rest = text.partition(":")
    if kind not in ("box", "ball"):
        return _of_file(text)
    try:
        numbers = np.array([float(part) for part in rest.split(",")])
    except ValueError:
        numbers = np.zeros(0)
    wanted = 6 if kind == "box" else 4
    sound = len(numbers) == wanted and np.isfinite(numbers).all()
    if sound and kind == "box":
        corners = np.sort(numbers.reshape(2, 3), axis=0)
        numbers, sound = corners.ravel(), bool((corners[0] < corners[1]).all())
    if not sound or (kind == "ball" and not numbers[3] > 0.0):
        raise ValueError(f"region is {text!r}; {_WANTED}")
    return Region(text, numbers)


def region_doubts(text: str, points) -> list[Doubt]:
    """One doubt where none of some samples (n, 3) is in the region that a text names.

    >>> [doubt.name for doubt in region_doubts("ball:0,0,0,2", [[5.0, 0.0, 0.0]])]
    ['empty region']
    """
    if not text or (region_of(text).distance(points) == 0.0).any():
        return []
    words = (
        f"Nothing was met in the region {text}, of which nothing is known; see whether its place, "
        "frame and unit are those of the object."
    )
    return [Doubt("empty region", words, NOWHERE)]


def _of_file(text: str) -> Region:
    """The inside of a mesh file, whose lengths are in the unit of the touches."""
    path = Path(text)
    if not path.is_file():
        raise ValueError(f"region is {text!r}, which is no file; {_WANTED}")
    if path.suffix.lower() in _IN_METRES:
        raise ValueError(
            f"region is {text!r}, a STEP file; give a mesh of it, in the unit of the touches"
        )
    try:
        content = path.read_bytes()
    except OSError as error:
        words = error.strerror or type(error).__name__
        raise ValueError(f"region is {text!r}, which can't be read ({words}); {_WANTED}") from None
    return _of_mesh(text, content)


@lru_cache(maxsize=4)
def _of_mesh(text: str, content: bytes) -> Region:
    """The inside of the mesh that a file of a name holds."""
    import trimesh

    try:
        mesh = trimesh.load_mesh(BytesIO(content), file_type=Path(text).suffix.lstrip(".").lower())
    except Exception as error:  # noqa: BLE001 - readers raise whatever they meet.
        words = " ".join(str(error).split())[:200]
        raise ValueError(f"region is {text!r}, which can't be read ({words}); {_WANTED}") from None
    if not isinstance(mesh, trimesh.Trimesh) or not mesh.is_watertight:
        raise ValueError(f"region is {text!r}, which is no closed mesh; {_WANTED}")
    return Region(text, np.zeros(0), mesh)


def _signed_distance(mesh, points) -> np.ndarray:
    """(n,) distance of points (n, 3) from a closed mesh, negative inside, length."""
    import igl

    from touchatlas.atlas.mesh.winding import winding_numbers

    vertices, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    square, _, _ = igl.point_mesh_squared_distance(points, vertices, faces)
    inside = np.abs(winding_numbers(vertices, faces, points)) > 0.5
    return np.where(inside, -np.sqrt(square), np.sqrt(square))
