"""Rolling ball: an edge that is rounded by a ball which touches both of its faces.

With the signed distances a and b of a point from two faces, negative inside, and the cosine c of
their normals, the ball of radius r has its centre where both distances are -r. From there the point
lies at (α n1 + β n2) with a + r = α + c β and b + r = c α + β. It is between the two lines at which
the ball touches the faces where α and β are positive.
"""

import numpy as np

# Least value of 1 - c^2: faces at less than 3 degrees have no edge. Doubled, nothing changes.
_LEAST = 3e-3


def ball_radius(first, second, cosine) -> np.ndarray:
    """(n,) radius of the ball whose surface passes points, from their signed distances from two
    faces, both negative inside; NaN where they are outside of one of them, or both face alike.

    Of two such balls it is the one that the point faces: r (1 - c) = -(a + b) + √(2 a b (1 + c)).

    Examples
    --------
    A point of the diagonal of a right angle, whose ball has the radius one:

    >>> depth = -(1.0 - np.sqrt(0.5))
    >>> ball_radius(np.array([depth]), np.array([depth]), np.zeros(1)).round(12)
    array([1.])
    """
    inside = (first <= 0.0) & (second <= 0.0)
    product = np.where(inside, first * second, np.nan)
    # Rounding takes cosines beyond -1 and 1.
    apart = np.where(cosine < 1.0, 1.0 - cosine, np.nan)
    root = np.sqrt(2.0 * product * np.maximum(1.0 + cosine, 0.0))
    return (-(first + second) + root) / apart


def ball_chord(radius, cosine) -> np.ndarray:
    """(n,) distance between the lines at which balls of radii (n,), or of one radius, touch two
    faces.

    Examples
    --------
    In a right angle:

    >>> ball_chord(1.0, np.zeros(1)).round(3)
    array([1.414])
    """
    return np.asarray(radius * np.sqrt(np.maximum(2.0 - 2.0 * cosine, 0.0)))


def rounded_edge(first, second, cosine, radius) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance (..., n) from an edge that is rounded with a radius, and the weights
    (..., n, 2) of both normals in its gradient; of radii (..., 1) at once.

    Beside the ball it is the larger of the distances (n,) from both faces, and the weight of that
    face is one.
    """
    a, b = first + radius, second + radius
    square = np.maximum(1.0 - cosine**2, _LEAST)
    u, v = (a - cosine * b) / square, (b - cosine * a) / square
    length = np.sqrt(np.maximum(a * u + b * v, np.finfo(float).tiny))
    ball = (u > 0.0) & (v > 0.0)
    weights = np.empty((*ball.shape, 2))
    weights[..., 0] = np.where(ball, u / length, first >= second)
    weights[..., 1] = np.where(ball, v / length, first < second)
    return np.where(ball, length - radius, np.maximum(first, second)), weights


def radius_slope(weights) -> np.ndarray:
    """(n,) derivative of the distance of ``rounded_edge`` with respect to the radius, from its
    weights: n · (n1 + n2) / (1 + c) - 1, zero where the ball touches a face, and beside it."""
    return np.asarray(weights.sum(axis=1) - 1.0)


def rounded_corner(distances, normals, radius) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signed distance (n,) and normal (n, 3) of a corner of three faces that is rounded with radii
    (n,), and whether (n,) the ball that touches all three decides.

    Parameters
    ----------
    distances : (n, 3) float, length
    normals : (n, 3, 3) float, unit
        The normals of the three faces.
    radius : (n,) float, length
    """
    gram = normals @ normals.transpose(0, 2, 1)
    sound = np.linalg.det(gram) > _LEAST
    gram = np.where(sound[:, None, None], gram, np.eye(3))
    moved = distances + radius[:, None]
    weights = np.linalg.solve(gram, moved[:, :, None])[:, :, 0]
    ball = sound & (weights > 0.0).all(axis=1)
    offset = (weights[:, :, None] * normals).sum(axis=1)
    length = np.maximum(np.sqrt((offset * offset).sum(axis=1)), np.finfo(float).tiny)
    return length - radius, offset / length[:, None], ball
