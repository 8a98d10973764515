"""The separate parts of a body, and what of them lies inside others."""

import igl
import numpy as np
from scipy.sparse.csgraph import connected_components

from touchatlas.atlas.mesh.winding import winding_numbers
from touchatlas.sim.world.triangles import areas_of


def part_of_faces(faces) -> np.ndarray:
    """(f,) for each triangle, the number of the connected part that it belongs to."""
    _, labels = connected_components(igl.adjacency_matrix(faces), directed=False)
    # Vertices of no triangle are no part.
    return np.unique(labels[faces[:, 0]], return_inverse=True)[1]


def hidden(points, own, vertices, faces, labels=None) -> np.ndarray:
    """(n,) whether points of the parts ``own`` (n,) lie inside of another part.

    ``labels`` (f,) are ``part_of_faces``, where they are known.

    A point is inside of a part if its generalized winding number about it is not zero (Jacobson et
    al., Robust Inside-Outside Segmentation, 2013). No touch from outside reaches it.

    Examples
    --------
    A corner of a cube of side 1 in one of side 3:

    >>> import trimesh
    >>> outer, inner = (trimesh.creation.box((side,) * 3) for side in (3, 1))
    >>> both = trimesh.util.concatenate([outer, inner])
    >>> hidden(np.full((2, 3), 0.5), np.array([0, 1]), both.vertices, both.faces).tolist()
    [False, True]
    """
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
    labels = part_of_faces(faces) if labels is None else labels
    found = np.zeros(len(points), bool)
    if not labels.any():
        return found
    ends = np.cumsum(np.bincount(labels))[:-1]
    for part, triangles in enumerate(np.split(faces[np.argsort(labels, kind="stable")], ends)):
        corners = vertices[np.unique(triangles)]
        within = (points > corners.min(axis=0)) & (points < corners.max(axis=0))
        some = np.flatnonzero(within.all(axis=1) & (own != part) & ~found)
        if len(some):
            found[some] = _enclosed(points[some], vertices, triangles)
    return found


def hidden_area(vertices, faces, owners=(), inside=(), labels=None) -> float:
    """Fraction of the area of a body that lies inside of other parts of it.

    Parameters
    ----------
    vertices : (v, 3) float, length
    faces : (f, 3) int
    owners, inside : (n,) int, bool, optional
        Faces of samples, and whether these are hidden: they tell the share of a face. Of a face
        without samples its middle does.
    labels : (f,) int, optional
        ``part_of_faces``, where they are known.

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
    labels = part_of_faces(faces) if labels is None else labels
    if not labels.any():
        return 0.0
    owners = np.asarray(owners, int)
    count = np.bincount(owners, minlength=len(faces))
    share = np.bincount(owners, np.asarray(inside, float), len(faces)) / np.maximum(count, 1)
    bare = np.flatnonzero(count == 0)
    middles = vertices[faces[bare]].mean(axis=1)
    share[bare] = hidden(middles, labels[bare], vertices, faces, labels)
    areas = areas_of(vertices, faces)
    return float((areas * share).sum() / areas.sum())


def turned_outward(vertices, faces) -> tuple[np.ndarray, int]:
    """Faces with each closed part turned outward, and how many parts were inside out.

    A part that lies inside of another keeps to it: the wall of a cavity stays turned into the
    cavity, and is turned with the body around it.

    Parameters
    ----------
    vertices : (v, 3) float, length
    faces : (f, 3) int
        Wound alike within each part.
    """
    vertices, faces = np.asarray(vertices, float), np.array(faces, np.int64)
    labels = part_of_faces(faces)
    count = int(labels.max()) + 1
    # Six times the volume about the middle, which loses fewest digits.
    a, b, c = (vertices[faces] - vertices[faces].mean(axis=(0, 1))).transpose(1, 0, 2)
    volume = np.bincount(labels, (a * np.cross(b, c)).sum(axis=1), count)
    first = np.unique(labels, return_index=True)[1]
    corners = vertices[faces[first, 0]]
    inner = hidden(corners, np.arange(count), vertices, faces, labels)
    turned = ~inner & (volume < 0.0)
    for part in np.flatnonzero(turned):
        mine = faces[labels == part]
        box = vertices[np.unique(mine)]
        within = (corners > box.min(axis=0)) & (corners < box.max(axis=0))
        some = np.flatnonzero(inner & within.all(axis=1))
        if len(some):
            turned[some[_enclosed(corners[some], vertices, mine)]] = True
    wrong = turned[labels]
    faces[wrong] = faces[wrong][:, ::-1]
    return faces, int((turned & ~inner).sum())


def _enclosed(points, vertices, triangles) -> np.ndarray:
    """(n,) points that triangles (t, 3) are around."""
    # Openings of a tenth of all directions are left; the inside of a deep bowl has more.
    return np.asarray(np.abs(winding_numbers(vertices, triangles, points)) > 0.9)
