"""The noise of curves, from residuals of short fits."""

import numpy as np
from scipy.special import gammaincinv

from touchatlas.patch.geometry.arrays import cross


def estimate_noise(points, normals) -> float:
    """Noise of curves from the residuals of short section fits, robust to outliers.

    Quadratics through seven successive points (of a hundred along a curve that has more), five
    or six where there are no more, within each curve's plane; the median of their
    residual squares over its expected value.

    Parameters
    ----------
    points : sequence of (n, 3) float, length, world
    normals : (c, 3) float, unit
        Of the curves' planes.

    Returns
    -------
    float, length
        Of each coordinate; what a quadratic does not follow of the shape counts as noise.
    """
    variances = []
    for curve, normal in zip(points, normals, strict=True):
        size = min(7, len(curve))
        # Points closer together than the noise tell no direction.
        stride = max(1, len(curve) // 100)
        index = np.arange(len(curve) - stride * (size - 1))[:, None] + stride * np.arange(size)
        window = curve[index] - curve[index].mean(axis=1, keepdims=True)
        along = window[:, -1] - window[:, 0]
        across = cross(np.broadcast_to(normal, along.shape), along)
        across /= np.sqrt(np.maximum((across**2).sum(axis=1, keepdims=True), np.finfo(float).tiny))
        s, h = ((window @ axis[:, :, None])[..., 0] for axis in (along, across))
        s = s / np.maximum(np.abs(s).max(axis=1, keepdims=True), np.finfo(float).tiny)
        powers, _ = np.linalg.qr(s[..., None] ** np.arange(3.0))
        rest = h - (powers @ (powers.transpose(0, 2, 1) @ h[..., None]))[..., 0]
        variances.append((rest**2).sum(axis=1) / (2.0 * gammaincinv(0.5 * (size - 3), 0.5)))
    return float(np.sqrt(np.median(np.concatenate(variances))))
