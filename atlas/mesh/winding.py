"""Winding numbers of triangle meshes."""

import igl
import numpy as np


def winding_numbers(vertices, faces, points) -> np.ndarray:
    """How often triangles wind about points (Jacobson, Kavan and Sorkine-Hornung 2013, by the
    expansion of Barill and others 2018): 1 in a closed solid, 0 outside.

    Parameters
    ----------
    vertices : (v, 3) float, length
    faces : (f, 3) int
    points : (n, 3) float, length

    Returns
    -------
    (n,) float

    Notes
    -----
    The expansion of libigl loses digits far from the origin: a ball whose middle is a million of
    its radii away has points on the wrong side. So places are taken from the middle of the mesh.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> winding_numbers(corners, faces, np.array([[0.5, 0.5, 0.5], [5.0, 5.0, 5.0]])).round(3) + 0.0
    array([1., 0.])
    """
    middle = np.mean(vertices, axis=0)
    near = np.ascontiguousarray(np.asarray(vertices, float) - middle)
    at = np.ascontiguousarray(np.asarray(points, float) - middle)
    return np.asarray(igl.fast_winding_number(near, np.asarray(faces, np.int64), at))
