"""Kinds of pieces: plane, sphere, cylinder, cone, torus, quadric, quartic and sextic, and the terms
of each.

A cone and a torus are distances in closed form. Every other piece is the zero set of
F = z - φ(x, y, z) in a frame of its own. The φ of a plane has three monomials, that of the other
quadrics nine; the quartic has the 21 of ``graded_basis(4)``, the sextic the 49 of
``graded_basis(6)``. In every array the terms, derivatives by the coefficients, are the first axis.
"""

from enum import IntEnum

import numpy as np

from touchatlas.atlas.pieces import cone, torus
from touchatlas.patch.geometry.polynomial import (
    GRADIENT,
    derivative_coefficients,
    graded_basis,
    monomials,
)


class Kind(IntEnum):
    """What law a piece obeys, in order of the number of parameters. Files hold its name."""

    PLANE = 0
    SPHERE = 1
    CYLINDER = 2
    CONE = 3
    TORUS = 4
    QUADRIC = 5
    QUARTIC = 6
    SEXTIC = 7

    @property
    def parameters(self) -> int:
        """Number of parameters that the samples determine."""
        return (3, 4, 5, 6, 7, 9, 21, 49)[self]

    @property
    def terms(self) -> int:
        """Number of coefficients: of the monomials of φ, or of a closed form."""
        return (3, 9, 9, 7, 8, 9, 21, 49)[self]

    @property
    def lawful(self) -> bool:
        """Whether the piece is a plane, sphere, cylinder, cone, torus or quadric."""
        return self < Kind.QUARTIC


# Kinds that are no polynomials, but distances.
CLOSED_FORMS = {Kind.CONE: cone, Kind.TORUS: torus}
# Laws of fewer parameters than a quadric.
SIMPLE_LAWS = tuple(kind for kind in Kind if kind < Kind.QUADRIC)
# Kinds that labels may have, by the number of parameters.
LABEL_KINDS = tuple(kind for kind in Kind if kind <= Kind.QUARTIC)
SEXTIC_BASIS = graded_basis(6)
_BASES = {Kind.QUARTIC: graded_basis(4), Kind.SEXTIC: SEXTIC_BASIS}
# Prior standard deviations of scaled coefficients by their order, no unit. A ball of the piece's
# size has second-order coefficients of 0.5. Doubled, quartics fold between contours.
_DEVIATIONS = np.array([3.0, 3.0, 1.0, 0.5, 0.5, 0.5, 0.5])
_QUADRIC_PRIOR = _DEVIATIONS[[0, 1, 1, 2, 2, 2, 2, 2, 2]] ** -2.0
_PRIORS = {kind: _DEVIATIONS[basis.orders] ** -2.0 for kind, basis in _BASES.items()}


def prior_precision(kind: Kind) -> np.ndarray:
    """(t,) prior precision of the scaled coefficients."""
    return _QUADRIC_PRIOR[: kind.terms] if kind.lawful else _PRIORS[kind]


def terms_at(kind: Kind, scaled) -> np.ndarray:
    """(s, n) monomials at scaled local points (n, 3) of a kind that has them. Those of quartics and
    sextics have z itself last."""
    x, y, z = scaled.T
    if not kind.lawful:
        return monomials(_BASES[kind], x, y, z)
    out = np.empty((kind.terms, len(scaled)))
    out[0], out[1], out[2] = 1.0, x, y
    if kind is Kind.PLANE:
        return out
    for row, (a, b) in enumerate(((x, x), (x, y), (y, y), (x, z), (y, z), (z, z)), 3):
        np.multiply(a, b, out=out[row])
    return out


def value_and_gradient(kind: Kind, coefficients, scaled, terms) -> tuple[np.ndarray, np.ndarray]:
    """F (n,) and its gradient (n, 3) at scaled local points (n, 3) with their monomials."""
    if not kind.lawful:
        rows = derivative_coefficients(_BASES[kind], coefficients, list(GRADIENT))
        values = rows @ terms
        gradient = -values[1:].T
        gradient[:, 2] += 1.0
        return scaled[:, 2] - values[0], gradient
    _, b, c, *second = coefficients.tolist()
    flat = np.array([-b, -c, 1.0])
    if kind is Kind.PLANE:
        gradient = np.empty((len(scaled), 3))
        gradient[:] = flat
    else:
        xx, xy, yy, xz, yz, zz = second
        gradient = flat - scaled @ np.array(
            [[2.0 * xx, xy, xz], [xy, 2.0 * yy, yz], [xz, yz, 2.0 * zz]]
        )
    return scaled[:, 2] - coefficients @ terms, gradient


def value_gradient_terms(kind: Kind, coefficients, scaled):
    """F (n,), its gradient (n, 3) and terms (s, n) of a kind at scaled local points (n, 3)."""
    if kind in CLOSED_FORMS:
        return CLOSED_FORMS[kind].value_gradient_terms(coefficients, scaled)
    terms = terms_at(kind, scaled)
    return *value_and_gradient(kind, coefficients, scaled, terms), terms


def outward_change(kind: Kind, coefficients) -> np.ndarray:
    """(t,) change of the coefficients, over the distance by which it moves the surface outward: of
    a polynomial the constant, along the normal at the origin."""
    if kind in CLOSED_FORMS:
        return np.asarray(CLOSED_FORMS[kind].outward_change(coefficients))
    return np.eye(len(coefficients))[0]


def hessians(kind: Kind, coefficients, scaled) -> np.ndarray:
    """(n, 3, 3) second derivatives of F at scaled local points (n, 3)."""
    if kind in CLOSED_FORMS:
        return CLOSED_FORMS[kind].hessians(coefficients, scaled)
    if not kind.lawful:
        # XX, XY, XZ, YY, YZ, ZZ of touchatlas.patch.geometry.polynomial.
        rows = derivative_coefficients(_BASES[kind], coefficients, [3, 4, 7, 5, 8, 9])
        xx, xy, xz, yy, yz, zz = -(rows @ terms_at(kind, scaled))
    elif kind is Kind.PLANE:
        return np.zeros((len(scaled), 3, 3))
    else:
        xx, xy, yy, xz, yz, zz = -np.asarray(coefficients)[3:] * np.array([2, 1, 2, 1, 1, 2])
    flat = np.array([xx, xy, xz, xy, yy, yz, xz, yz, zz]).T
    return np.broadcast_to(flat.reshape(-1, 3, 3), (len(scaled), 3, 3))
