"""Fit a file of contours and report it: numbers, flags, files."""

import difflib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from touchatlas.atlas.files import write_whole
from touchatlas.patch import FitOptions, Patch, Penalty, diagnose, fit_paper, fit_patch
from touchatlas.sim.recorded.contour_file import read_curves
from touchatlas.sim.recorded.fit_picture import patch_surface, png_bytes
from touchatlas.sim.recorded.recording import Recording, prepare
from touchatlas.sim.run.ply import ply_bytes

FILES = ("patch.json", "patch.ply", "patch.png")
_MAPS = {"map": FitOptions(), "monge": FitOptions(height_only=True, adaptive=False)}
_PAPER = {
    "total_curvature": Penalty.TOTAL_CURVATURE,
    "excess_curvature": Penalty.EXCESS_CURVATURE,
    "least_squares": Penalty.NONE,
}
METHODS = (*_MAPS, *_PAPER)
# Of the sections: 60 degrees apart it is 1.4, within about 20 degrees of each other 10.
_POOR_CONDITION = 10.0
# Cosine to the normal below which a direction tells no side.
_SIDEWAYS = 0.05
# Fewest points of a fit: a quadric has six coefficients.
_LEAST_COUNT = 6
# Relative variance of the estimated noise, times the number of contour points.
_ESTIMATED = 1.1
# Residuals below this fraction of the noise show that the noise is not that of these points. Twice
# as much would doubt the noise of good fits with many terms.
_TOO_NOISY = 1.0 / 3.0
_OUTLIER, _MEDIAN_TO_STD = 5.0, 1.4826
MEANING = {
    "repeated points": "Points that a curve repeats exactly were counted once.",
    "noise estimated": "The noise was not given; it was estimated from the curves.",
    "outward side assumed": "The outward side was not given; the one to which the surface bulges "
    "was taken.",
    "curves do not meet": "The curves miss their common point by more than noise explains: one may "
    "be displaced. The miss was counted as noise, which makes the deviations hold it.",
    "curves not planar": "A curve leaves its sampling plane by more than noise explains; see to "
    "nx, ny, nz, or track each curve in one plane.",
    "curves cut": "Curves were used only until they turn by 45 degrees from the reference point.",
    "edge crossed": "A curve runs over an edge; only its part on the reference point's side was "
    "used.",
    "one-sided curves": "A curve ends near the reference point, much nearer than others; the patch "
    "goes on without it there. It is better to track as far to both sides.",
    "umbilic": "k1 and k2 differ by no more than noise explains, so e1 and e2 were chosen, not "
    "measured.",
    "poorly conditioned sections": "The curves run in similar directions, so k1, k2 and their "
    "directions are ill determined; planes 60 degrees apart are best.",
    "residuals exceed noise": "The patch misses its points by more than noise explains; leave "
    "--noise out if it was given, or track shorter curves.",
    "noise exceeds residuals": "The points lie much closer to the patch than --noise says; give it "
    "in the unit of the file, or leave it out.",
    "outliers": "Some points were left out as bad contacts.",
}
# Units of what is printed, where it has one.
UNITS = {
    **dict.fromkeys(("origin", "radius", "residual rms", "noise"), "file's unit"),
    **dict.fromkeys(("k1", "k2"), "1 / file's unit"),
}


@dataclass(frozen=True, eq=False)
class FitReport:
    """A patch fitted to recorded contours, and what is doubtful about it.

    Parameters
    ----------
    name : str
        Of the file.
    method : str
        One of METHODS.
    recording : Recording
    patch : Patch
    outliers : int
        Samples that were left out as bad contacts.
    flags : tuple of str
        Keys of MEANING.
    residual_rms : float, length
        Root mean square distance of the points within the radius from the patch, bad contacts
        left out.
    assumed : tuple of str
        What was found out about the file, in sentences.
    """

    name: str
    method: str
    recording: Recording
    patch: Patch
    outliers: int
    flags: tuple[str, ...]
    residual_rms: float
    assumed: tuple[str, ...] = ()

    def as_dict(self) -> dict:
        """The numbers of ``touchatlas fit --json``, all finite: lengths in the unit of the file.

        ``normal_std`` (rad) is the root mean square angle between the true and the found normal
        at the origin.
        """
        patch, polynomial = self.patch, self.patch.polynomial
        curvatures = patch.curvatures
        std = np.sqrt(np.diagonal(patch.covariance))
        unit = patch.radius ** (1.0 - polynomial.basis.orders)
        slopes_std = std[polynomial.basis.orders == 1]
        return {
            "method": self.method,
            "frame": {"origin": patch.frame.origin.tolist(), "axes": patch.frame.axes.tolist()},
            "terms": polynomial.basis.exponents.tolist(),
            "coefficients": polynomial.unscaled().tolist(),
            "coefficients_std": (std * unit).tolist(),
            "radius": float(patch.radius),
            "k1": curvatures.k1,
            "k2": curvatures.k2,
            "k1_std": float(curvatures.std[0]),
            "k2_std": float(curvatures.std[1]),
            "umbilic": curvatures.umbilic,
            "condition": float(patch.condition),
            "normal_std": float(np.sqrt((slopes_std**2).sum())),
            "residual_rms": self.residual_rms,
            "noise_std": float(patch.noise_std),
            "count": int(patch.count),
            "outliers": self.outliers,
            "flags": list(self.flags),
            "assumed": list(self.assumed),
            "diagnosis": diagnose(patch, self.recording.contours).as_dict(),
        }

    def summary(self) -> dict[str, str]:
        """The main values with their standard deviations, as text."""
        patch, curvatures = self.patch, self.patch.curvatures
        tilt = np.rad2deg(self.as_dict()["normal_std"])
        return {
            "origin": _triple(patch.frame.origin),
            "normal": f"{_triple(patch.frame.normal)} +- {tilt:.2g} degrees",
            "k1": f"{curvatures.k1:.5g} +- {curvatures.std[0]:.2g}",
            "k2": f"{curvatures.k2:.5g} +- {curvatures.std[1]:.2g}",
            "direction of k1": "any" if curvatures.umbilic else _triple(curvatures.directions[0]),
            "radius": f"{patch.radius:.5g}",
            "terms": f"{patch.polynomial.basis.size}",
            "condition of the sections": f"{patch.condition:.3g}",
            "residual rms": f"{self.residual_rms:.3g}",
            "noise": f"{patch.noise_std:.3g}",
            "points used": f"{patch.count} of {len(_all_points(self.recording))}",
            "outliers": f"{self.outliers}",
        }

    def json(self) -> str:
        """``as_dict`` as strict JSON."""
        return json.dumps(self.as_dict(), indent=2, allow_nan=False)

    def write(self, folder: Path) -> None:
        """Write patch.json, patch.ply and patch.png, each whole or not at all."""
        surface = patch_surface(self.patch)
        title = f"{self.name}: {self.method}"
        contents = (
            (self.json() + "\n").encode(),
            ply_bytes(surface, float(surface.deviation.max()) or self.patch.radius),
            png_bytes(self.recording, self.patch, surface, title),
        )
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in zip(FILES, contents, strict=True):
            write_whole(folder / name, content)


def fit_file(path, method="map", noise=None, point=None, outward=None) -> FitReport:
    """Patch from a CSV file of contours.

    Parameters
    ----------
    path : path-like
        Columns curve, x, y, z and, if known, nx, ny, nz.
    method : str
        One of METHODS.
    noise : float, length, optional
        Standard deviation of each coordinate; estimated where None.
    point : (3,) float, length, optional
        Reference point; where the curves meet where None.
    outward : (3,) float, optional
        Any vector on the outer side; where None, the side to which the surface bulges.

    Raises
    ------
    ValueError
        In one sentence, what is wrong with the file or an option.
    """
    if method not in METHODS:
        near = difflib.get_close_matches(method, METHODS, 1)
        hint = f"did you mean {near[0]}?" if near else f"choose from {', '.join(METHODS)}"
        raise ValueError(f"there is no method {method!r}; {hint}")
    curves, repeated, assumed = read_curves(path)
    recording = prepare(curves, noise, point)
    side = _outer_side(recording) if outward is None else _shortened(outward)
    patch, outliers = _fit(method, recording, side)
    if patch.count < _LEAST_COUNT:
        raise ValueError(
            f"only {patch.count} points lie within {patch.radius:.3g} of the reference point, "
            "where the nearest curve ends; give a point farther from the ends, or track further"
        )
    cosine = float(patch.frame.normal @ side) / max(float(np.sqrt(side @ side)), 1e-300)
    if cosine < _SIDEWAYS:
        raise ValueError(
            f"outward {','.join(f'{x:g}' for x in side)} lies within 3 degrees of the tangent "
            "plane and tells no side; give a direction that points out of the body"
        )
    flags = ["repeated points"] if repeated else []
    flags += [*recording.flags, *([] if outward is not None else ["outward side assumed"])]
    residual = _residual_rms(patch, recording)
    flags += _doubts(patch, outliers, residual, recording, noise is None)
    return FitReport(
        Path(path).name, method, recording, patch, outliers, tuple(flags), residual, assumed
    )


def _shortened(vector) -> np.ndarray:
    """(3,) a direction by components of one at most."""
    vector = np.asarray(vector, dtype=float)
    return vector / max(float(np.abs(vector).max()), np.finfo(float).tiny)


def _fit(method: str, recording: Recording, outward) -> tuple[Patch, int]:
    point, contours = recording.point, recording.contours
    if method in _PAPER:
        return fit_paper(point, contours, outward, _PAPER[method]), 0
    # A lack of fit as large as the noise is borne; beyond, the patch is made smaller.
    fit = fit_patch(
        point,
        contours,
        outward,
        shared=recording.scattered,
        options=_MAPS[method],
    )
    return fit.patch, int(fit.outliers)


def _outer_side(recording: Recording) -> np.ndarray:
    """(3,) normal to whose side the surface bulges: its mean curvature is not positive."""
    patch, _ = _fit("map", recording, np.ones(3))
    mean = patch.curvatures.k1 + patch.curvatures.k2
    return -patch.frame.normal if mean > 0.0 else patch.frame.normal


def _triple(vector) -> str:
    return ", ".join(f"{x:.4g}" for x in vector)


def _all_points(recording: Recording) -> np.ndarray:
    return np.concatenate([*(c.points for c in recording.contours), recording.scattered])


def _residual_rms(patch: Patch, recording: Recording) -> float:
    points = _all_points(recording)
    away = ((points - patch.frame.origin) ** 2).sum(axis=1)
    distance = np.abs(patch.signed_distance(points[away <= patch.radius**2]))
    typical = max(_MEDIAN_TO_STD * float(np.median(distance)), patch.noise_std)
    return float(np.sqrt(np.mean(distance[distance <= _OUTLIER * typical] ** 2)))


def _doubts(patch: Patch, outliers: int, residual, recording, estimated: bool) -> list[str]:
    size = sum(len(contour.points) for contour in recording.contours)
    variance = 0.5 / patch.count + (_ESTIMATED / size if estimated else 0.0)
    expected = patch.noise_std * np.exp(3.0 * np.sqrt(variance))
    # Rounding leaves residuals of this size where there is no noise.
    rounding = 1e-6 * patch.radius
    found = {
        "umbilic": patch.curvatures.umbilic,
        "poorly conditioned sections": patch.condition > _POOR_CONDITION,
        "residuals exceed noise": residual > max(expected, rounding),
        "noise exceeds residuals": not estimated and residual < _TOO_NOISY * patch.noise_std,
        "outliers": outliers > 0,
    }
    return [flag for flag, holds in found.items() if holds]


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


def check_folder(folder, force: bool) -> Path:
    """A folder for the files of a report, not made yet.

    Raises
    ------
    ValueError
        When it is a file, or holds such files and ``force`` is not set.
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder} is a file; give a folder with --out")
    held = [name for name in FILES if (folder / name).exists()]
    if held and not force:
        raise ValueError(
            f"{folder} already holds {', '.join(held)}; choose another --out, or --force to "
            "replace them"
        )
    return folder
