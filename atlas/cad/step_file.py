"""STEP export: the trimmed patches of an atlas as a file that CAD systems read.

Every patch becomes one trimmed Bezier surface, and every side one curve that its two faces share.
Each surface is off the curve by half the gap between the patches, which the file states as the
tolerance of the edge. Faces that close up become a solid.
"""

from dataclasses import dataclass
from pathlib import Path

import networkx as nx

from touchatlas.atlas.cad.bezier_face import BezierFace, bezier_face
from touchatlas.atlas.cad.occ_kernel import is_closed, need_kernel, step_bytes
from touchatlas.atlas.cad.trimmed_patches import trimmed_patches
from touchatlas.atlas.files import write_whole
from touchatlas.atlas.state import AtlasState

# Largest error of a face's height, in tolerances: negligible beside the patch's own error. Doubled,
# some faces get a lower degree.
_HEIGHT_ERROR = 1e-4


@dataclass(frozen=True)
class StepReport:
    """The contents of a STEP file and their accuracy.

    Parameters
    ----------
    faces, solids, open_shells : int
        Numbers of each in the file.
    left_out : int
        Faces of patches that stand upright within their own cells.
    height_error : float, length
        Largest difference between a patch and its Bezier surface on its cell.
    gap : float, length
        Largest distance of a side from its trace on a surface: the tolerance of the file.
    """

    faces: int
    solids: int
    open_shells: int
    left_out: int
    height_error: float
    gap: float


def save_step(state: AtlasState, path) -> StepReport:
    """Write an atlas as a STEP file, one trimmed Bezier face a patch: all of it or nothing.

    Parameters
    ----------
    state : AtlasState
    path : path
        The file. One unit of length of the atlas is one millimetre there. Equal atlases give equal
        bytes: the header has no date.

    Returns
    -------
    StepReport

    Raises
    ------
    ValueError
        When the atlas has no patch, or none with a height, or the extra ``cad`` is not
        installed.
    OSError
        When the file cannot be written; an old one is left as it was.
    """
    need_kernel()
    found = [bezier_face(face, _HEIGHT_ERROR * state.tolerance) for face in trimmed_patches(state)]
    faces = [face for face in found if face is not None]
    if not faces:
        raise ValueError("every patch stands upright within its own cell; touch more closely")
    parts = components(faces)
    gap = max(float(face.gaps.max()) for face in faces)
    write_whole(path, step_bytes(parts, gap, Path(path).name))
    return StepReport(
        len(faces),
        sum(map(is_closed, parts)),
        len(parts) - sum(map(is_closed, parts)),
        len(found) - len(faces),
        max(face.error for face in faces),
        gap,
    )


def components(faces: list[BezierFace]) -> list[list[BezierFace]]:
    """Faces that are connected by shared sides, each component in the given order."""
    graph = nx.Graph()
    for index, face in enumerate(faces):
        graph.add_edges_from((("face", index), side.number) for side in face.face.sides)
    parts = [
        sorted(node[1] for node in part if isinstance(node, tuple))
        for part in nx.connected_components(graph)
    ]
    return [[faces[index] for index in part] for part in sorted(parts)]
