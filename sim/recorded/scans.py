"""Files of points as scans: what an atlas learns without touches."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from touchatlas.atlas import Scan
from touchatlas.atlas.samples.neighbourhoods import noise_of_cloud
from touchatlas.patch.fit.curve_noise import estimate_noise
from touchatlas.patch.geometry.section import LEAST_POINTS
from touchatlas.patch.words import count_of
from touchatlas.sim.recorded.contour_file import read_curves
from touchatlas.sim.recorded.curve_errors import check_order
from touchatlas.sim.recorded.curves import Curve, ReadOptions
from touchatlas.sim.recorded.recorded_arms import with_tip
from touchatlas.sim.recorded.unit_mix import other_file
from touchatlas.sim.world.units import MILLIMETRES


@dataclass(frozen=True, eq=False)
class SideOptions:
    """What a user says of the outer side of all points, where files do not say it.

    Parameters
    ----------
    approach, viewpoint, outside : (3,) float, optional
        See ``Scan``.
    """

    approach: np.ndarray | None = None
    viewpoint: np.ndarray | None = None
    outside: np.ndarray | None = None


class ReadScans(NamedTuple):
    """Scans of files, how each file was read, in sentences, and the unit, "" where none is
    named."""

    scans: list[Scan]
    said: list[str]
    unit: str


def read_scans(
    paths: Sequence,
    noise: Sequence[float] = (),
    options: ReadOptions = ReadOptions(),
    sides: SideOptions = SideOptions(),
    unit: str = "",
) -> ReadScans:
    """Scans of files of curves, points and clouds, one for each kind of what tells the outer side:
    first those with normals, then those with directions of approach, then the others.

    Parameters
    ----------
    paths : paths of the files
    noise : floats, length
        Standard deviation of each coordinate of each point: one for all files, or one for each;
        estimated from each where there is none.
    options : ReadOptions
    sides : SideOptions
    unit : str
        That of what was learned before; files of another unit are converted.

    Raises
    ------
    ValueError
        A file cannot be read, or its noise cannot be estimated.
    """
    if len(noise) not in (0, 1, len(paths)):
        raise ValueError(
            f"got {len(noise)} of --noise for {count_of(len(paths), 'file')}; give one for "
            "all, one for each, or none, to estimate it"
        )
    if options.tip:
        first = options.unit or unit or read_curves(paths[0], options).unit
        options = with_tip(options, paths, first)
    kinds: dict[str, list[tuple[Curve, float, float]]] = {"normals": [], "sides": [], "": []}
    said, unnamed = [], []
    for k, path in enumerate(paths):
        # The atlas takes the tip off.
        file = read_curves(path, replace(options, tip_radius=0.0))
        factor = 1.0
        if unit and file.unit and file.unit != unit:
            factor = MILLIMETRES[file.unit] / MILLIMETRES[unit]
        unit = unit or file.unit
        found = noise[min(k, len(noise) - 1)] if len(noise) else _noise(path, file.curves, factor)
        words = f"{path}: {file.how}; noise {found:.3g}" + ("" if len(noise) else ", estimated")
        said += [words + (f"; converted to {unit}" if factor != 1.0 else ""), *file.warnings]
        unnamed += [] if file.unit else [(str(path), file.curves)]
        for curve in file.curves:
            kind = "" if curve.outward is None else "normals" if curve.exact else "sides"
            kinds[kind].append((curve, factor, found))
    if other := other_file(unnamed):
        said.append(other.words)
    if options.tip_radius:
        said.append(f"points are centres of a tip of radius {options.tip_radius:g}")
    tip = options.tip_radius, options.systematic_std
    scans = [_scan(kind, curves, sides, tip) for kind, curves in kinds.items() if curves]
    return ReadScans(scans, said, unit)


def _scan(kind: str, curves: list[tuple[Curve, float, float]], sides: SideOptions, tip) -> Scan:
    """One scan of curves that all say the same of their outer side, with the factor of the unit and
    the noise of each, by a tip of a radius and a systematic deviation, length."""
    counts = [len(curve.points) for curve, *_ in curves]
    points = np.concatenate([factor * curve.points for curve, factor, _ in curves])
    names = [k if curve.name else -1 for k, (curve, *_) in enumerate(curves)]
    outward = None
    if kind:
        given = [curve.outward for curve, *_ in curves if curve.outward is not None]
        outward = np.concatenate(given)
        # Where a file leaves them out, none is given.
        if not np.isfinite(outward).all():
            kind, outward = "", None
    approach = outward if kind == "sides" else sides.approach
    return Scan(
        points,
        np.repeat([noise for *_, noise in curves], counts),
        normals=outward if kind == "normals" else None,
        approach=None if kind == "normals" else approach,
        viewpoint=sides.viewpoint,
        outside=sides.outside,
        curves=np.repeat(names, counts),
        tip_radius=tip[0],
        systematic_std=tip[1],
    )


def _noise(path, curves: list[Curve], factor: float) -> float:
    """Noise of the points of a file, length, estimated from curves, else from the cloud."""
    long = [c.points for c in curves if c.name and len(c.points) >= LEAST_POINTS + 2]
    if long:
        for curve in curves:
            if curve.name and len(curve.points) >= LEAST_POINTS:
                check_order(curve.name, curve.points, np.inf)
        planes = [np.linalg.svd(p - p.mean(axis=0), full_matrices=False)[2][2] for p in long]
        return factor * estimate_noise(long, np.array(planes))
    points = np.concatenate([curve.points for curve in curves])
    found = noise_of_cloud(cKDTree(points))
    if found is None:
        raise ValueError(
            f"{path} has {count_of(len(points), 'point')}, too few to tell how noisy they are; "
            "give --noise, the standard deviation of each coordinate"
        )
    return factor * found
