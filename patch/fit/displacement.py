"""Curves that may each be displaced as a whole: by how much, and what stays uncertain then."""

from dataclasses import replace

import numpy as np

from touchatlas.patch.fit.bad_contacts import without_bad_contacts
from touchatlas.patch.fit.estimate import FIT_REACH
from touchatlas.patch.fit.fit_patch import FitOptions, PatchFit, fit_patch, unsolvable_is_unfit
from touchatlas.patch.fit.residual_tests import linearised
from touchatlas.patch.fit.smoothness import coefficient_precision
from touchatlas.patch.fit.start import UnfitError
from touchatlas.patch.geometry.contour import Contour, SamplingPlane
from touchatlas.patch.geometry.patch import Patch

_FIXED_TERMS = FitOptions(adaptive=False)


def prior_of(fit: PatchFit) -> np.ndarray:
    """(t,) precision of a patch's scaled coefficients before its fit."""
    basis = fit.patch.polynomial.basis
    return coefficient_precision(basis, [fit.length_ratio], [fit.z_scale])[0]


def displaced(contours: tuple[Contour, ...], shifts) -> tuple[Contour, ...]:
    """Contours, each moved by its shift (c, 3), length, world."""
    return tuple(
        replace(c, points=c.points + s, plane=SamplingPlane(c.plane.point + s, c.plane.normal))
        for c, s in zip(contours, shifts, strict=True)
    )


@unsolvable_is_unfit()
def estimate_displacements(
    point, contours: tuple[Contour, ...], outward, spread: float
) -> np.ndarray:
    """Most probable displacement (c, 3) of each contour from one surface, length, world.

    The error that all samples of a contour share is no noise: it does not fall with their number.
    Sample j of contour i has the residual r = phi c + n . d_i + e, with noise e and a displacement
    d_i of standard deviation ``spread`` in each coordinate: a linear mixed model.

    Parameters
    ----------
    point : (3,) float, length, world
    contours : tuple of Contour
    outward : (3,) float, world
    spread : float, length

    Notes
    -----
    Henderson, Best linear unbiased estimation and prediction under a selection model, Biometrics
    1975. Surface and displacements are found in turn. For given coefficients that are optimal, the
    Newton step of the displacements alone has the Schur complement as its matrix.
    """
    contours = tuple(without_bad_contacts(c) for c in contours)
    shifts, least = np.zeros((len(contours), 3)), np.inf
    # At first the displacements count as noise, so that the surface does not follow them.
    for blur in spread * 0.5 ** np.arange(10):
        current = tuple(
            replace(c, noise_std=float(np.hypot(c.noise_std, blur)))
            for c in displaced(contours, -shifts)
        )
        try:
            fit = fit_patch(point, current, outward, options=_FIXED_TERMS)
        except UnfitError:
            if not shifts.any():
                raise
            break
        change = _newton_step(fit, current, shifts, spread)
        size = float(np.abs(change).max())
        # No step hides more than it counts as noise. Once that is small, errors of the gradients
        # would move the curves along the surface, where their place is hardly known.
        if size > max(least, 2.0 * current[0].noise_std):
            break
        shifts, least = shifts + change, size
    return shifts


@unsolvable_is_unfit()
def displacement_covariance(
    patch: Patch, contours: tuple[Contour, ...], spread: float, prior: np.ndarray
) -> np.ndarray:
    """(t, t) covariance that unknown displacements add to that of the scaled coefficients.

    Parameters
    ----------
    patch : Patch
        Fitted to the contours, from which estimated displacements were taken.
    contours : tuple of Contour
    spread : float, length
        Standard deviation of each coordinate of a displacement, before the fit.
    prior : (t,) float
        Precision of the scaled coefficients before the fit.

    Notes
    -----
    With A^-1 the covariance for known displacements, B the mixed block of the normal equations and
    S the Schur complement, the marginal covariance is A^-1 + A^-1 B S^-1 B^t A^-1.
    """
    cleaned = [without_bad_contacts(c) for c in contours]
    parts = [_linearised(patch, c) for c in cleaned]
    mixed = np.concatenate([terms.T @ moves for _, terms, moves in parts], axis=1)
    gram = sum(terms.T @ terms for _, terms, _ in parts)
    inner = np.linalg.inv(gram + np.diag(prior))
    precision = _schur(parts, mixed, inner, patch.radius / spread)
    effect = inner @ mixed
    return effect @ np.linalg.solve(precision, effect.T)


def _newton_step(fit: PatchFit, contours, shifts, spread: float) -> np.ndarray:
    """(c, 3) change of the displacements, length, world."""
    patch = fit.patch
    parts = [_linearised(patch, c) for c in contours]
    prior = prior_of(fit)
    gram = sum(terms.T @ terms for _, terms, _ in parts) + np.diag(prior)
    mixed = np.concatenate([terms.T @ moves for _, terms, moves in parts], axis=1)
    weight = patch.radius / spread
    precision = _schur(parts, mixed, np.linalg.inv(gram), weight)
    pull = np.concatenate([moves.T @ r for r, _, moves in parts])
    # The coefficients need not be optimal for these samples: their own step goes first.
    gradient = np.concatenate([terms.T @ r for r, terms, _ in parts]).reshape(len(parts), -1)
    pull = pull - mixed.T @ np.linalg.solve(
        gram, gradient.sum(axis=0) - prior * patch.polynomial.coefficients
    )
    pull = pull - weight**2 * shifts.ravel() / patch.radius
    return patch.radius * np.linalg.solve(precision, pull).reshape(-1, 3)


def _schur(parts, mixed, covariance, weight: float) -> np.ndarray:
    """(3 c, 3 c) precision of the displacements, scaled, with the coefficients integrated out."""
    count = len(parts)
    own = np.zeros((3 * count, 3 * count))
    for i, (_, _, moves) in enumerate(parts):
        own[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = moves.T @ moves
    values, vectors = np.linalg.eigh(own - mixed.T @ covariance @ mixed)
    # Negative by rounding only.
    return (vectors * (np.maximum(values, 0.0) + weight**2)) @ vectors.T


def _linearised(patch: Patch, contour: Contour):
    """Residuals (n,) of a contour's samples near a patch, its terms (n, t) and displacements
    (n, 3), world and scaled, there; all over the deviation of the noise."""
    _, value, gradient, std, beyond, terms = linearised(patch, contour, FIT_REACH)
    std = np.sqrt(std**2 + beyond)
    return value / std, terms / std[:, None], gradient @ patch.frame.axes / std[:, None]
