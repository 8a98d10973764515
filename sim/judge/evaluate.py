"""The judge: distances between a triangle surface and the ground truth, both ways."""

from dataclasses import asdict, dataclass

import numpy as np

from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.sim.judge.closest_points import ClosestPoints
from touchatlas.sim.judge.judgement import is_met, truth_warnings
from touchatlas.sim.judge.surface_file import check_deviation, check_triangles
from touchatlas.sim.judge.truth import EvaluateOptions, Truth
from touchatlas.sim.world.triangles import (
    interpolated,
    sample_triangles,
    surface_normals,
    topology_of,
)


@dataclass(frozen=True)
class Evaluation:
    """How far a surface is from the truth; lengths in the file's unit.

    ``accuracy`` is the distance from the surface to the truth, ``completeness`` that from the
    truth to the surface. ``coverage`` is the fraction of the true area within the tolerance of the
    surface. ``accuracy_max_place`` and ``completeness_max_place`` are the points of the
    surface and of the truth with these distances.
    ``f_score`` is the harmonic mean of precision and recall at one tolerance.
    ``deviation_calibration`` is the fraction of the surface whose distance from the truth is within
    1.96 predicted deviations (None when none are predicted); what the surface does not reach counts
    in ``coverage`` alone. ``components`` is the number of separate parts of the truth, and
    ``components_reached`` of those of which a point is within three tolerances of the surface.
    ``hidden_area`` is the fraction of the true area that lies inside of other parts; it counts in
    ``coverage`` alone. Maxima are over vertices, too.
    ``normal_error_deg`` is measured where the truth is within three tolerances (None where nothing
    is): elsewhere the nearest surface is another part of the object.
    """

    coverage: float
    accuracy_mean: float
    accuracy_rms: float
    accuracy_p95: float
    accuracy_max: float
    accuracy_max_place: tuple[float, ...]
    completeness_mean: float
    completeness_rms: float
    completeness_p95: float
    completeness_max: float
    completeness_max_place: tuple[float, ...]
    chamfer: float
    hausdorff: float
    f_score: float
    normal_error_deg_mean: float | None
    normal_error_deg_p95: float | None
    deviation_calibration: float | None
    watertight: bool
    euler_characteristic: int
    true_euler_characteristic: int | None
    components: int
    components_reached: int
    hidden_area: float
    tolerance: float
    diagonal: float

    def as_dict(self) -> dict:
        """Field names to plain numbers, whether the tolerance is met, and warnings."""
        return asdict(self) | {"met": self.met, "warnings": self.warnings}

    @property
    def met(self) -> bool:
        """Whether the tolerance is met, both ways."""
        return is_met(asdict(self))

    @property
    def warnings(self) -> list[str]:
        """What of the truth was not reached, in sentences."""
        return truth_warnings(asdict(self))


def evaluate_surface(
    vertices,
    faces,
    truth: Truth,
    tolerance: float,
    rng,
    deviation=None,
    options: EvaluateOptions = EvaluateOptions(),
) -> Evaluation:
    """Distances between a surface and the truth, both ways, and the surface's topology.

    Parameters
    ----------
    vertices : (v, 3) float, length
    faces : (f, 3) int
    truth : Truth
    tolerance : float, length, > 0
    rng : numpy.random.Generator
        Samples the surface.
    deviation : (v,) float, length, optional
        Predicted standard deviation at each vertex, >= 0.
    options : EvaluateOptions

    Raises
    ------
    ValueError
        No triangles, no area, NaN, wrong shapes, tolerance not positive.

    Examples
    --------
    A unit square a quarter above another:

    >>> from touchatlas.sim.judge.truth import truth_from_mesh
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> faces, rng = np.array([[0, 1, 2], [0, 2, 3]]), np.random.default_rng(0)
    >>> truth = truth_from_mesh(square, faces, rng)
    >>> evaluate_surface(square + [0, 0, 0.25], faces, truth, 0.1, rng).chamfer
    0.25
    """
    vertices, faces = check_triangles(vertices, faces, "the surface")
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise ValueError(f"tolerance is {tolerance}; it must be a length > 0")
    deviation = None if deviation is None else check_deviation(deviation, len(vertices))
    sampled, owners = sample_triangles(vertices, faces, options.samples, rng)
    corners, true_corners = vertices[np.unique(faces)], truth.corners
    # A point of both is off by some last digits of the coordinates, by more on slivers.
    rounding = 1e-12 * float(np.abs(truth.vertices).max())
    accuracy, at_corners = (truth.closest(points, rounding)[0] for points in (sampled, corners))
    closest = ClosestPoints(vertices, faces)
    completeness, index, feet = closest(truth.points, rounding)
    at_true, _, _ = closest(true_corners, rounding)
    normals = surface_normals(vertices, faces, index, feet)
    false, false_place = _farthest((accuracy, sampled), (at_corners, corners))
    predicted = None
    if deviation is not None:
        predicted = interpolated(deviation[faces], vertices, faces, owners, sampled)
    reached, parts = completeness <= 3.0 * tolerance, truth.part_of_face[truth.owners]
    found = {*parts[reached], *truth.part_of_corners[at_true <= 3.0 * tolerance]}
    near = ~truth.hidden
    reach = completeness[near]
    missing, missing_place = _farthest(
        (reach, truth.points[near]), (at_true[~truth.hidden_corners], truth.seen_corners)
    )
    seen = reached & near
    angles = _angles_deg(normals[seen], truth.normals[seen])
    topology = topology_of(faces)
    return Evaluation(
        float(np.mean(completeness <= tolerance)),
        *_statistics(accuracy),
        false,
        false_place,
        *_statistics(reach),
        missing,
        missing_place,
        0.5 * float(accuracy.mean() + reach.mean()),
        max(false, missing),
        _f_score(accuracy, reach, tolerance),
        float(angles.mean()) if len(angles) else None,
        float(np.quantile(angles, 0.95)) if len(angles) else None,
        _calibration(accuracy, predicted),
        topology.is_closed and topology.is_wound_alike,
        topology.euler_characteristic,
        truth.euler_characteristic if truth.closed else None,
        int(truth.part_of_face.max()) + 1,
        len(found),
        truth.hidden_area,
        float(tolerance),
        truth.diagonal,
    )


def _f_score(accuracy, completeness, tolerance: float) -> float:
    """Harmonic mean of precision and recall: the fractions of both distances within a tolerance
    (Knapitsch et al., Tanks and Temples, 2017)."""
    precision, recall = np.mean(accuracy <= tolerance), np.mean(completeness <= tolerance)
    return float(2.0 * precision * recall / (precision + recall)) if precision + recall else 0.0


def _calibration(error, predicted) -> float | None:
    """Fraction of errors within 1.96 predicted deviations; None when none are predicted."""
    return None if predicted is None else float(np.mean(error <= SURE * predicted))


def _farthest(*groups) -> tuple[float, tuple[float, ...]]:
    """The largest of distances (n,) at points (n, 3), over several groups, and its place."""
    distance, points = (np.concatenate(part) for part in zip(*groups, strict=True))
    return float(distance.max()), tuple(points[distance.argmax()].tolist())


def _statistics(distance) -> tuple[float, float, float]:
    """Mean, rms and 95th percentile."""
    return (
        float(distance.mean()),
        float(np.sqrt(np.mean(distance**2))),
        float(np.quantile(distance, 0.95)),
    )


def _angles_deg(a, b) -> np.ndarray:
    """(n,) angles between vectors, degrees (Kahan): small ones have all their digits."""
    a, b = (v / np.maximum(_length(v), np.finfo(float).tiny) for v in (a, b))
    return np.rad2deg(2.0 * np.arctan2(_length(a - b), _length(a + b)))[:, 0]


def _length(vectors) -> np.ndarray:
    """(n, 1) lengths of vectors."""
    return np.sqrt((vectors**2).sum(axis=1, keepdims=True))
