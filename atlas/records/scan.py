"""Scan: points that were measured without a touch: single curves, single points, or a cloud."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.geometry.arrays import check_length, check_points, frozen_array


@dataclass(frozen=True, eq=False)
class Scan:
    """Points of the surface, however they were measured.

    What tells the outer side may be left out where the curves are closed, where the points are all
    over a closed body, and where the atlas knows the surface about them already.

    Parameters
    ----------
    points : (n, 3) float, length, world
        Of the surface, or of the centre of a ball at the tip.
    noise_std : float or (n,) float, length, >= 0
        Standard deviation of each coordinate of each point.
    normals : (n, 3) float, world, optional
        Outward, of any length.
    approach : (3,) or (n, 3) float, world, optional
        Directions, of any length, from the surface to where the points were reached or seen from.
    viewpoint : (3,) float, length, world, optional
        A point that all points were seen from, as the centre of a camera.
    outside : (3,) float, length, world, optional
        A point near the surface that is outside of the body.
    curves : (n,) int, optional
        Number of the curve that each point is of; those of a curve are in order of travel. Without,
        or where it is negative, a point is of no curve.
    tip_radius, systematic_std : float, length
        See ``Touch``.

    Examples
    --------
    A single point with its normal, and a circle:

    >>> point = Scan([[0, 0, 1]], 0.02, normals=[[0, 0, 1]])
    >>> angle = np.linspace(0, 2 * np.pi, 60)
    >>> circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> len(Scan(circle, 0.02, curves=np.zeros(60, int)))
    60
    """

    points: np.ndarray
    noise_std: np.ndarray
    normals: np.ndarray | None = None
    approach: np.ndarray | None = None
    viewpoint: np.ndarray | None = None
    outside: np.ndarray | None = None
    curves: np.ndarray | None = None
    tip_radius: float = 0.0
    systematic_std: float = 0.0

    def __post_init__(self) -> None:
        points = check_points(self.points, "scan points")
        count = len(points)
        noise = _each(self.noise_std, (count,), "noise_std")
        if not (noise >= 0.0).all():
            raise ValueError(f"noise_std is {self.noise_std}; it must be a length >= 0")
        own = {
            "points": points,
            "noise_std": noise,
            "normals": _directions(self.normals, count, "normals"),
            "approach": _directions(self.approach, count, "approach"),
        }
        for name in ("tip_radius", "systematic_std"):
            check_length(getattr(self, name), name)
        for name in ("viewpoint", "outside"):
            value = getattr(self, name)
            own[name] = None if value is None else frozen_array(value, (3,), name)
        if self.curves is not None:
            try:
                curves = np.array(self.curves)
            except ValueError:
                curves = np.array(None)
            if curves.shape != (count,) or curves.dtype.kind not in "iu":
                raise ValueError(
                    f"curves are of shape {curves.shape} and type {curves.dtype}; give one whole "
                    f"number for each of the {count} points"
                )
            curves.flags.writeable = False
            own["curves"] = curves
        for name, value in own.items():
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def toward(self) -> np.ndarray:
        """(n, 3) unit directions from the points to where they were reached or seen from; zero
        where that is not known."""
        if self.approach is not None:
            return self.approach
        if self.viewpoint is None:
            return np.zeros((len(self), 3))
        away = self.viewpoint - self.points
        length = np.sqrt((away * away).sum(axis=1))[:, None]
        return np.asarray(away / np.maximum(length, np.finfo(float).tiny))


def _each(value, shape: tuple[int, ...], name: str) -> np.ndarray:
    """A read-only array of a shape, from one value for all or one for each."""
    try:
        every = np.broadcast_to(value, shape) if np.ndim(value) < len(shape) else value
    except ValueError:
        every = value
    return frozen_array(every, shape, name)


def _directions(values, count: int, name: str) -> np.ndarray | None:
    """(n, 3) read-only unit vectors, from one for all or one for each; ValueError for one of
    length zero."""
    if values is None:
        return None
    vectors = _each(values, (count, 3), name)
    # Squares of large components overflow.
    length = np.hypot(np.hypot(vectors[:, :1], vectors[:, 1:2]), vectors[:, 2:])
    if not (length > 0.0).all():
        raise ValueError(f"{name} holds a vector of length 0; give directions, or leave them out")
    return frozen_array(vectors / length, (count, 3), name)
