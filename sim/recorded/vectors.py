"""Vectors beside points: normals of sampling planes, normals of the surface, or its outer side."""

import numpy as np

from touchatlas.patch.geometry.section import LEAST_POINTS


def what_vectors_are(groups) -> str:
    """``planes``, ``normals`` or ``sides``: what the vectors of the points of a file are.

    Parameters
    ----------
    groups : list of (str, (n, 3) float, (n, 3) float)
        Name of each curve, "" for scattered points, its points, and its vectors; NaN where one is
        not given.

    Examples
    --------
    A curve over a ball, with the normal of its plane, the ball's own, and upward:

    >>> a = np.linspace(-0.5, 0.5, 11)[:, None]
    >>> arc = np.cos(a) * [0, 0, 1.0] + np.sin(a) * [1.0, 0, 0]
    >>> for vectors in (0 * arc + [0, 1.0, 0], arc, 0 * arc + [0, 0, 1.0]):
    ...     what_vectors_are([("a", arc, vectors)])
    'planes'
    'normals'
    'sides'
    """
    known = [(n, p, v) for n, p, v in groups if np.isfinite(v[:, 0]).any()]
    curves = [(p, v) for n, p, v in known if n and len(p) >= LEAST_POINTS]
    if known and all(_of_one_plane(p, v) for _, p, v in known) and not _of_one_face(known):
        return "planes"
    lean = [_lean(p, v) for p, v in curves]
    # Sine of three degrees: normals of a surface are as upright on a chord of a curve.
    return "sides" if lean and np.median(lean) > 0.05 else "normals"


def _of_one_plane(points, vectors) -> bool:
    """Whether the vectors are alike, and the points lie in the plane across them."""
    given = vectors[np.isfinite(vectors[:, 0])]
    if not _are_along(given, given[0]):
        return False
    best = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(points))
    return _lie_in_plane(points, given[0], 4.0 * float(best))


def _are_along(vectors, normal) -> bool:
    """Whether vectors (n, 3) are alike: lines of one plane differ by less than two degrees."""
    return bool((np.abs(vectors @ normal) > 0.99939).all())


def _lie_in_plane(points, normal, least: float = 0.0) -> bool:
    """Whether points (n, 3) are beside a plane by less than a length ``least``, or by a hundredth
    of their own length."""
    height = (points - points.mean(axis=0)) @ normal
    length = float(np.ptp(points, axis=0).max())
    return float(np.sqrt(np.mean(height**2))) <= max(0.01 * length, least)


def _of_one_face(groups) -> bool:
    """Whether all points of several curves lie in one plane across their vectors: a flat face."""
    normal = next(v[np.isfinite(v[:, 0])][0] for _, _, v in groups)
    if not all(_are_along(v[np.isfinite(v[:, 0])], normal) for _, _, v in groups):
        return False
    one = _lie_in_plane(np.concatenate([p for _, p, _ in groups]), normal)
    return one and (len(groups) > 1 or not groups[0][0])


def _lean(points, vectors) -> float:
    """Root mean square cosine of vectors and chords of a curve over a tenth of it either way."""
    reach = max(1, len(points) // 10)
    chord = points[2 * reach :] - points[: -2 * reach]
    length = np.sqrt((chord**2).sum(axis=1))
    middle = vectors[reach:-reach]
    cosine = (chord * middle).sum(axis=1) / np.maximum(length, np.finfo(float).tiny)
    cosine = cosine[np.isfinite(cosine) & (length > 0.5 * np.median(length))]
    return float(np.sqrt(np.mean(cosine**2))) if len(cosine) else 0.0
