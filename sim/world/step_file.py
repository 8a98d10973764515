"""STEP files as triangles, by Open CASCADE, in the unit of the file."""

import re
from pathlib import Path

import numpy as np

from touchatlas.atlas.cad.kernel import need_kernel
from touchatlas.sim.world.units import MILLIMETRES, UNITS


def load_step(path: Path, sagitta: float = 1e-4) -> tuple[np.ndarray, np.ndarray, str]:
    """Vertices (v, 3) and triangles (f, 3) of all solids and shells of a STEP file, and its unit.

    Parameters
    ----------
    path : Path
    sagitta : float
        Largest distance of triangles from the surfaces, in diagonals of the body.

    Raises
    ------
    ValueError
        In one sentence: the extra ``cad`` is missing, the file is damaged or holds no surface.
    """
    need_kernel()
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader

    from touchatlas.atlas.cad.kernel import silence

    with silence():
        reader = STEPControl_Reader()
        done = reader.ReadFile(str(path)) == IFSelect_RetDone
        if done:
            reader.TransferRoots()
    if not done or reader.NbShapes() == 0:
        raise ValueError(f"{path} cannot be read as STEP: it is damaged, or holds no shape")
    shape, box = reader.OneShape(), Bnd_Box()
    BRepBndLib.Add_s(shape, box)
    if box.IsVoid():
        raise ValueError(f"{path} holds no surface; give a STEP file of a body")
    diagonal = float(np.sqrt(box.SquareExtent()))
    # The kernel bounds sides along one direction; on a ball those across are as far off again.
    BRepMesh_IncrementalMesh(shape, 0.4 * sagitta * diagonal, False, 0.2, False)
    vertices, faces = _triangles(shape)
    unit = _unit(path.read_text(errors="replace"))
    # The kernel reads in millimetres.
    return vertices / MILLIMETRES[unit], faces, unit


def _unit(text: str) -> str:
    """The unit of length of a file, millimetres where it names none that is known.

    >>> _unit("#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.));")
    'm'
    """
    if found := re.search(
        r"CONVERSION_BASED_UNIT\s*\(\s*'(INCH|FOOT|MIL)\w*'", text, re.IGNORECASE
    ):
        return UNITS[found[1].lower()]
    found = re.search(r"SI_UNIT\s*\(\s*\.?(\$|\w+)\.?\s*,\s*\.METRE\.", text)
    names = {"$": "m", "MILLI": "mm", "CENTI": "cm", "DECI": "dm", "MICRO": "um"}
    return names.get(found[1], "mm") if found else "mm"


def _triangles(shape) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of the faces of a meshed shape, turned as the faces are."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    vertices: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    count, explorer = 0, TopExp_Explorer(shape, TopAbs_FACE)
    while explorer.More():
        face, location = TopoDS.Face(explorer.Current()), TopLoc_Location()
        drawn = BRep_Tool.Triangulation_s(face, location)
        if drawn is not None:
            move = location.Transformation()
            nodes = [drawn.Node(i).Transformed(move) for i in range(1, drawn.NbNodes() + 1)]
            corners = [drawn.Triangle(i).Get() for i in range(1, drawn.NbTriangles() + 1)]
            triangles = np.array(corners, np.int64).reshape(-1, 3) - 1 + count
            if face.Orientation() == TopAbs_REVERSED:
                triangles = triangles[:, ::-1]
            vertices.append(np.array([[p.X(), p.Y(), p.Z()] for p in nodes]).reshape(-1, 3))
            faces.append(triangles)
            count += len(nodes)
        explorer.Next()
    if not faces:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    return np.concatenate(vertices), np.concatenate(faces)
