"""Bezier faces of a smooth surface: as few as are within a bound of it."""

import numpy as np

from touchatlas.atlas.cad.bezier.bezier import face_normals, face_points
from touchatlas.atlas.cad.bezier.bezier_tree import BezierTree, first_tree
from touchatlas.atlas.cad.bezier.fit_bezier import At
from touchatlas.atlas.cad.bezier.halve_faces import with_halved

# Degree of curves and faces, no unit: a face has 16 control points. Raised to five, faces err about
# half as much and take half as many bytes again.
_DEGREE = 3
# Most times that a face is halved. Doubled, faces become as small as the noise where the field
# jumps.
_HALVINGS = 4
# Error of halves over that of their face, at which the surface is rough and the face stays if it is
# within two bounds: halves of bicubic faces of a smooth surface err a sixteenth. Doubled, rough
# places fill with faces.
_NO_BETTER = 0.7
# Parameters along a face at which it is compared with the surface, both sides included. Doubled,
# errors are found that are larger by a tenth.
_COMPARED = 7
# Least cosine between the normals of a face and of the surface: 60 degrees. Doubled to 1, faces are
# halved everywhere.
_ALIKE = 0.5


def bezier_faces(vertices, quads, at: At, bound: float) -> tuple[BezierTree, np.ndarray]:
    """Bezier faces in the place of quadrilaterals, halved until they are within a bound of a
    surface.

    Parameters
    ----------
    vertices : (v, 3) float, length
        Near the surface.
    quads : (q, 4) int
        Counter-clockwise as seen from outside.
    at : function
        Signed distance and normal of the surface near points.
    bound : float, length
        Largest distance at the points of a grid on each face. Where the surface is rough, faces are
        farther: up to twice that, or more where their halves would be folded.

    Returns
    -------
    tree : BezierTree
    errors : (f,) float, length
        Largest distance of each face from the surface; infinite where it is folded.
    """
    tree = first_tree(vertices, quads, at, _DEGREE)
    errors = _errors(tree, range(len(tree.faces)), at)
    stays = np.zeros(len(errors), bool)
    for _ in range(_HALVINGS):
        far = np.flatnonzero((errors > bound) & ~stays)
        trial, numbers, found = _halved(tree, far, at)
        rough = _are_rough(errors[far], found, bound)
        stays[far[rough]] = True
        if rough.any():
            far = far[~rough]
            trial, numbers, found = _halved(tree, far, at)
        if not len(far):
            break
        tree = trial
        stays = np.append(stays, np.zeros(3 * len(far), bool))
        errors = np.append(errors, np.zeros(3 * len(far)))
        errors[numbers] = found
    return tree, errors


def _halved(tree: BezierTree, faces, at: At) -> tuple[BezierTree, np.ndarray, np.ndarray]:
    """A tree with four faces in the place of each of some (k,), and the numbers (k, 4) and errors
    (k, 4) of these."""
    if not len(faces):
        return tree, np.zeros((0, 4), int), np.zeros((0, 4))
    tree, numbers = with_halved(tree, faces, at)
    return tree, numbers, _errors(tree, numbers.ravel(), at).reshape(-1, 4)


def _are_rough(errors, found, bound: float) -> np.ndarray:
    """(k,) whether faces with errors (k,) stay rather than become four with errors ``found``
    (k, 4): those are no nearer, or folded."""
    worst = found.max(axis=1)
    no_better = (errors <= 2.0 * bound) & (worst > _NO_BETTER * errors)
    return np.asarray(no_better | (np.isfinite(errors) & ~np.isfinite(worst)))


def _errors(tree: BezierTree, faces, at: At) -> np.ndarray:
    """(k,) largest distance of faces (k,) from the surface; infinite where one is folded."""
    grid = np.linspace(0.0, 1.0, _COMPARED)
    u, v = (x.ravel() for x in np.meshgrid(grid, grid, indexing="ij"))
    controls = np.array([tree.controls[k] for k in faces])
    points = face_points(controls, u, v).reshape(-1, 3)
    distance, normal = at(points)
    cosine = np.einsum("kc,kc->k", face_normals(controls, u, v).reshape(-1, 3), normal)
    off = np.where(cosine < _ALIKE, np.inf, np.abs(distance))
    return np.asarray(off.reshape(len(controls), -1).max(axis=1))
