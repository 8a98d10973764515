"""The separate parts of a body, and which of them no touch can reach."""

import igl
import numpy as np
from scipy.sparse.csgraph import connected_components

from touchatlas.sim.world.triangles import areas_of


def part_of_faces(faces) -> np.ndarray:
    """(f,) for each triangle, the number of the connected part that it belongs to."""
    _, labels = connected_components(igl.adjacency_matrix(faces), directed=False)
    # Vertices of no triangle are no part.
    return np.unique(labels[faces[:, 0]], return_inverse=True)[1]


def hidden_area(vertices, faces) -> float:
    """Fraction of the area of a body that lies in parts inside others.

    A part is inside another if the generalized winding number of the other about it is not zero
    (Jacobson et al., Robust Inside-Outside Segmentation, 2013). No touch from outside reaches it.

    Parameters
    ----------
    vertices : (v, 3) float, length
    faces : (f, 3) int

    Examples
    --------
    A cube of side 1 in one of side 3 has a tenth of the area of both:

    >>> import trimesh
    >>> outer, inner = (trimesh.creation.box((side,) * 3) for side in (3, 1))
    >>> both = trimesh.util.concatenate([outer, inner])
    >>> round(hidden_area(both.vertices, both.faces), 12)
    0.1
    """
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
    labels = part_of_faces(faces)
    ends = np.cumsum(np.bincount(labels))[:-1]
    parts = np.split(faces[np.argsort(labels, kind="stable")], ends)
    if len(parts) == 1:
        return 0.0
    corners = [vertices[np.unique(part)] for part in parts]
    low, high = (np.array([bound(c, axis=0) for c in corners]) for bound in (np.min, np.max))
    hidden = np.zeros(len(parts), bool)
    for outer, part in enumerate(parts):
        within = (low > low[outer]).all(axis=1) & (high < high[outer]).all(axis=1)
        for inner in np.flatnonzero(within & ~hidden):
            some = corners[inner][:: len(corners[inner]) // 16 + 1]
            turns = igl.fast_winding_number(vertices, part, some)
            # Openings of a tenth of all directions are left; the inside of a deep bowl has more.
            hidden[inner] = bool((np.abs(turns) > 0.9).all())
    areas = areas_of(vertices, faces)
    return float(areas[hidden[labels]].sum() / areas.sum())
