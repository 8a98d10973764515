"""Recording: time, pose and force of a probe, joined on one clock."""

from dataclasses import dataclass

import numpy as np

from touchatlas.patch.geometry.arrays import frozen_array


@dataclass(frozen=True, eq=False)
class Recording:
    """What a robot with a force sensor recorded.

    Parameters
    ----------
    times : (n,) float, s
        Rising.
    positions : (n, 3) float, length, world
        Of the tip's centre if the stylus is not bent.
    forces : (n, 3) float, N, world
        By the surface on the tip.
    unit : str
        Of the lengths; "" where it is not known.
    said : tuple of str
        How it was read, in sentences.
    """

    times: np.ndarray
    positions: np.ndarray
    forces: np.ndarray
    unit: str = ""
    said: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        times = frozen_array(self.times, (None,), "times")
        if len(times) < 2 or not (np.diff(times) > 0.0).all():
            raise ValueError("the times of a recording must rise, and be two or more")
        object.__setattr__(self, "times", times)
        for name in ("positions", "forces"):
            rows = frozen_array(getattr(self, name), (None, 3), name)
            if len(rows) != len(times):
                raise ValueError(
                    f"there are {len(rows)} {name} and {len(times)} times; give one each"
                )
            object.__setattr__(self, name, rows)


def joined(pose_times, poses, force_times, forces) -> tuple[np.ndarray, np.ndarray, int]:
    """Forces at the times of poses, between their neighbours in time.

    Poses and forces have clocks of their own. A pose has a force where there is one before and one
    after it, no more than three of their periods apart: else messages are missing.

    Parameters
    ----------
    pose_times, force_times : (n,), (m,) float, s, rising
    poses : (n, d) float
    forces : (m, 3) float

    Returns
    -------
    (k,) int
        Poses that have a force.
    (k, 3) float
        Their forces.
    int
        Number of poses without.

    Examples
    --------
    >>> joined(np.array([0.0, 1.5, 9.0]), np.zeros((3, 7)), np.arange(4.0), np.eye(4)[:, :3])
    (array([0, 1]), array([[1. , 0. , 0. ],
           [0. , 0.5, 0.5]]), 1)
    """
    period = float(np.median(np.diff(force_times)))
    after = np.searchsorted(force_times, pose_times, "left")
    inside = (pose_times >= force_times[0]) & (pose_times <= force_times[-1])
    after = np.clip(after, 1, len(force_times) - 1)
    inside &= force_times[after] - force_times[after - 1] <= 3.0 * period
    kept = np.flatnonzero(inside)
    found = [np.interp(pose_times[kept], force_times, column) for column in forces.T]
    return kept, np.stack(found, axis=1), len(poses) - len(kept)


def turned(vectors, quaternions) -> np.ndarray:
    """(n, 3) vectors turned by quaternions (n, 4) in the order x, y, z, w.

    v + 2 q x (q x v + w v), q the vector part. ValueError for one that is all zero.

    >>> turned(np.array([[1.0, 0.0, 0.0]]), np.array([[0.5, 0.5, 0.5, 0.5]]))
    array([[0., 1., 0.]])
    """
    length = np.sqrt((quaternions * quaternions).sum(axis=1))
    if not (length > 0.0).all():
        raise ValueError(
            f"{np.count_nonzero(~(length > 0.0))} of {len(length)} orientations are no quaternions "
            "with a length; record 0, 0, 0, 1 where the tip keeps its orientation"
        )
    q = quaternions / length[:, None]
    axis, w = q[:, :3], q[:, 3:]
    out: np.ndarray = vectors + 2.0 * np.cross(axis, np.cross(axis, vectors) + w * vectors)
    return out
