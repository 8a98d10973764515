"""The report of a patch that was fitted to recorded contours: numbers, flags, files."""

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from touchatlas.atlas.files import write_whole
from touchatlas.patch import Diagnosis, Patch, diagnose
from touchatlas.patch.fit.advice import advice_on
from touchatlas.sim.folder.out_folder import make_out_folder
from touchatlas.sim.folder.ply import ply_bytes
from touchatlas.sim.judge.number_meanings import LENGTH
from touchatlas.sim.recorded.fit_picture import patch_surface, png_bytes
from touchatlas.sim.recorded.recording import Recording

FILES = ("patch.json", "patch.ply", "patch.png")
_LENGTHS, _CURVATURES = ("origin", "radius", "residual rms", "noise"), ("k1", "k2")


@dataclass(frozen=True, eq=False)
class FitReport:
    """A patch fitted to recorded contours, and what is doubtful about it.

    Parameters
    ----------
    name : str
        Of the file.
    method : str
        Of the fit.
    recording : Recording
    patch : Patch
    outliers : int
        Samples that were left out as bad contacts.
    flags : tuple of str
        Keys of ``fit_flags.MEANING``.
    residual_rms : float, length
        Root mean square distance of the points within the radius from the patch, bad contacts
        left out.
    assumed : tuple of str
        How the file was read, in phrases.
    warnings : tuple of str
        What is probably wrong with the file, in sentences.
    unit : str
        Of the lengths.
    """

    name: str
    method: str
    recording: Recording
    patch: Patch
    outliers: int
    flags: tuple[str, ...]
    residual_rms: float
    assumed: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    unit: str = LENGTH

    @cached_property
    def diagnosis(self) -> Diagnosis:
        """Of the patch against the curves, with the noise that was stated or estimated."""
        return diagnose(self.patch, self.recording.contours)

    @property
    def displaced(self) -> tuple[str, ...]:
        """Names of the curves that are displaced from the others."""
        return tuple(self.recording.names[i] for i in self.diagnosis.displaced)

    @property
    def advice(self) -> tuple[str, ...]:
        """What to do about the doubts, a sentence each, with the names of the curves."""
        return advice_on(self.diagnosis.doubts, self.displaced)

    def as_dict(self) -> dict:
        """The numbers of ``touchatlas fit --json``, all finite: lengths in the file's unit.

        ``normal_std`` (rad) is the root mean square angle between the true and the found normal
        at the origin. ``displacement_std`` is that of each curve as a whole, 0 where the curves
        meet.
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
            "point_noise_std": float(self.recording.noise_std),
            "displacement_std": float(self.recording.displacement_std),
            "count": int(patch.count),
            "outliers": self.outliers,
            "warnings": list(self.warnings),
            "flags": list(self.flags),
            "assumed": list(self.assumed),
            "diagnosis": self.diagnosis.as_dict()
            | {"displaced": list(self.displaced), "advice": list(self.advice)},
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
            "noise": self._noise(),
            "points used": f"{patch.count} of {len(self.recording.all_points)}",
            "outliers": f"{self.outliers}",
        }

    @property
    def units(self) -> dict[str, str]:
        """Units of what the summary holds, where it has one."""
        lengths = dict.fromkeys(_LENGTHS, self.unit)
        return lengths | dict.fromkeys(_CURVATURES, f"1 / {self.unit}")

    def _noise(self) -> str:
        """The noise of the points, and apart from it how far whole curves may be displaced."""
        own, spread = self.recording.noise_std, self.recording.displacement_std
        if not spread:
            return f"{self.patch.noise_std:.3g}"
        given = "estimated" if "noise estimated" in self.flags else "stated"
        return f"{own:.3g} of each point, {given}; {spread:.3g} of each curve, as displacement"

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
        make_out_folder(folder)
        for name, content in zip(FILES, contents, strict=True):
            write_whole(folder / name, content)


def _triple(vector) -> str:
    return ", ".join(f"{x:.4g}" for x in vector)


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
