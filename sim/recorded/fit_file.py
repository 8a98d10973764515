"""Fit a patch to a file of contours."""

import difflib
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from touchatlas.patch import FitOptions, Patch, Penalty, fit_paper, fit_patch
from touchatlas.patch.entry_points import ESTIMATORS, added, load_added
from touchatlas.patch.fit.displacement import (
    displaced,
    displacement_covariance,
    estimate_displacements,
    prior_of,
)
from touchatlas.patch.words import count_of
from touchatlas.sim.judge.number_meanings import LENGTH
from touchatlas.sim.recorded.contour_file import read_curves
from touchatlas.sim.recorded.curves import Curve, ReadOptions
from touchatlas.sim.recorded.fit_flags import fit_flags, residual_rms
from touchatlas.sim.recorded.fit_report import FitReport
from touchatlas.sim.recorded.recorded_arms import with_tip
from touchatlas.sim.recorded.recording import Recording, prepare
from touchatlas.sim.recorded.unit_mix import OtherUnit, holding, other_unit, rescaled

_MAPS = {"map": FitOptions(), "monge": FitOptions(height_only=True, adaptive=False)}
_PAPER = {
    "total_curvature": Penalty.TOTAL_CURVATURE,
    "excess_curvature": Penalty.EXCESS_CURVATURE,
    "least_squares": Penalty.NONE,
}
METHODS = (*_MAPS, *_PAPER)


def fit_file(
    path, method="map", noise=None, point=None, outward=None, options: ReadOptions = ReadOptions()
) -> FitReport:
    """Patch from a file of contours.

    Parameters
    ----------
    path : path-like
        Columns curve, x, y, z and, if known, nx, ny, nz; other files as ``read_curves`` says.
    method : str
        One of METHODS, or of the estimators that other packages add: functions of a reference
        point, contours and an outward vector to a Patch.
    noise : float, length, optional
        Standard deviation of each coordinate; estimated where None.
    point : (3,) float, length, optional
        Reference point; where the curves meet where None.
    outward : (3,) float, optional
        Any vector on the outer side; where None, the side that the file's vectors tell, else the
        one to which the surface bulges.
    options : ReadOptions
        What the file does not say itself.

    Raises
    ------
    ValueError
        In one sentence, what is wrong with the file or an option.
    """
    if method not in METHODS and method not in added(ESTIMATORS):
        names = (*METHODS, *added(ESTIMATORS))
        near = difflib.get_close_matches(method, names, 1)
        hint = f"did you mean {near[0]}?" if near else f"choose from {', '.join(names)}"
        raise ValueError(f"there is no method {method!r}; {hint}")
    file = read_curves(path, options)
    if options.tip:
        options = with_tip(options, [path], file.unit)
        file = read_curves(path, options)
    outward = _told_side(file.curves) if outward is None else outward
    suspect = other_unit(file.curves)
    other = suspect and _readable(method, file.curves, suspect, noise, point, outward)
    try:
        recording, patch, outliers = _fitted(method, file.curves, noise, point, outward)
        if options.tip_radius and not all(curve.exact for curve in file.curves):
            moved = _off_tip(recording, patch, options.tip_radius)
            at = None if point is None else point - options.tip_radius * patch.frame.normal
            side = patch.frame.normal
            recording, patch, outliers = _fitted(method, moved, noise, at, side)
    except ValueError as error:
        words = f"{suspect.words}, or leave it out" if suspect and other else str(error)
        raise ValueError(f"{words}; {Path(path).name} was read so: {file.how}") from None
    warnings = list(file.warnings)
    if suspect and other:
        patch = holding(patch, other)
        warnings.insert(0, f"{suspect.words}. The deviations hold both readings.")
    flags = ["repeated points"] if file.repeated else []
    flags += [*recording.flags, *([] if outward is not None else ["outward side assumed"])]
    residual = residual_rms(patch, recording)
    flags += fit_flags(patch, outliers, residual, recording, noise is None)
    return FitReport(
        *(Path(path).name, method, recording, patch, outliers, tuple(flags), residual),
        *(file.assumed, tuple(warnings), file.unit or LENGTH),
    )


def _fitted(method: str, curves, noise, point, outward) -> tuple[Recording, Patch, int]:
    """Curves made ready, their patch, and the number of its outliers."""
    recording = prepare(curves, noise, point)
    side = _outer_side(recording) if outward is None else _shortened(outward)
    patch, outliers = _fit(method, recording, side)
    # A quadric has six coefficients.
    if patch.count < 6:
        raise ValueError(
            f"only {count_of(patch.count, 'point lies', 'points lie')} within {patch.radius:.3g} "
            "of the reference point, where the nearest curve ends; give a point farther from the "
            "ends, or track further"
        )
    cosine = float(patch.frame.normal @ side) / max(float(np.sqrt(side @ side)), 1e-300)
    if cosine < 0.05:
        raise ValueError(
            f"outward {','.join(f'{x:g}' for x in side)} lies within 3 degrees of the tangent "
            "plane and tells no side; give a direction that points out of the body"
        )
    return recording, patch, outliers


def _off_tip(recording: Recording, patch: Patch, radius: float) -> list[Curve]:
    """Curves of contacts from those of centres of a ball: a radius inward along the normals.

    The surface of the centres is parallel to that of the body, and so has the same normals.
    """
    named = zip(recording.names, (c.points for c in recording.contours), strict=True)
    return [
        Curve(name, points - radius * patch.normal(points), None)
        for name, points in (*named, ("", recording.scattered))
        if len(points)
    ]


def _told_side(curves) -> np.ndarray | None:
    """(3,) mean of the outward vectors beside the points; None where the file holds none."""
    told = [curve.outward for curve in curves if curve.outward is not None]
    return np.nanmean(np.concatenate(told), axis=0) if told else None


def _readable(method: str, curves, suspect: OtherUnit, noise, point, outward) -> Patch | None:
    """The patch with a curve taken to the unit of the others; None where it then does not fit."""
    try:
        return _fitted(method, rescaled(curves, suspect), noise, point, outward)[1]
    except ValueError:
        return None


def _shortened(vector) -> np.ndarray:
    """(3,) a direction by components of one at most."""
    vector = np.asarray(vector, dtype=float)
    return vector / max(float(np.abs(vector).max()), np.finfo(float).tiny)


def _fit(method: str, recording: Recording, outward) -> tuple[Patch, int]:
    """The patch, and the number of its outliers. Curves that do not meet are moved to where they
    most probably do, and what is uncertain about that is added to the covariance."""
    point, contours = recording.point, recording.contours
    spread = recording.displacement_std
    if spread:
        contours = displaced(contours, -estimate_displacements(point, contours, outward, spread))
    if method not in _MAPS:
        estimator = partial(fit_paper, penalty=_PAPER.get(method, Penalty.NONE))
        if method not in _PAPER:
            estimator = load_added(ESTIMATORS, method)
        patch, outliers = estimator(point, contours, outward), 0
        prior = np.ones(len(patch.covariance))
    else:
        shared, options = recording.scattered, _MAPS[method]
        fit = fit_patch(point, contours, outward, shared=shared, options=options)
        patch, outliers, prior = fit.patch, int(fit.outliers), prior_of(fit)
    if spread:
        more = displacement_covariance(patch, contours, spread, prior)
        patch = replace(patch, covariance=patch.covariance + more)
    return patch, outliers


def _outer_side(recording: Recording) -> np.ndarray:
    """(3,) normal to whose side the surface bulges: its mean curvature is not positive."""
    patch, _ = _fit("map", recording, np.ones(3))
    mean = patch.curvatures.k1 + patch.curvatures.k2
    return -patch.frame.normal if mean > 0.0 else patch.frame.normal


def parse_vector(text: str, name: str) -> np.ndarray:
    """(3,) numbers of an option written X,Y,Z.

    >>> parse_vector("0,-1,2.5", "--point")
    array([ 0. , -1. ,  2.5])
    """
    try:
        vector = np.array([float(part) for part in text.split(",")])
    except ValueError:
        vector = np.zeros(0)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ValueError(f"{name} is {text!r}; give three numbers as X,Y,Z, without spaces")
    return vector
