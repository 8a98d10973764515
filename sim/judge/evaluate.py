"""The judge: distances between a triangle surface and the ground truth, both ways."""

from dataclasses import asdict, dataclass

import igl
import numpy as np
import trimesh

from touchatlas.patch.geometry.normal_error import SURE
from touchatlas.sim.judge.closest_points import closest_points
from touchatlas.sim.judge.judgement import is_met, truth_warnings
from touchatlas.sim.judge.surface_file import check_deviation, check_triangles
from touchatlas.sim.judge.truth import EvaluateOptions, Truth
from touchatlas.sim.judge.truth_parts import hidden_area
from touchatlas.sim.world.triangles import sample_triangles

_BY_AREA = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_AREA


@dataclass(frozen=True)
class Evaluation:
    """How far a surface is from the truth; lengths in the file's unit.

    ``accuracy`` is the distance from the surface to the truth, ``completeness`` that from the
    truth to the surface. ``coverage`` is the fraction of the true area within three tolerances of
    the surface. ``accuracy_max_place`` and ``completeness_max_place`` are the points of the
    surface and of the truth with these distances.
    ``f_score`` is the harmonic mean of precision and recall at one tolerance.
    ``deviation_calibration`` is the fraction of the surface whose distance from the truth is within
    1.96 predicted deviations (None when none are predicted); what the surface does not reach counts
    in ``coverage`` alone. ``components`` is the number of separate parts of the truth, and
    ``components_reached`` of those of which a point is within three tolerances of the surface.
    ``hidden_area`` is the fraction of the true area in parts that lie inside others.
    ``normal_error_deg`` is measured where the truth is covered (None where nothing is): elsewhere
    the nearest surface is another part of the object.
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
    accuracy, _, _ = closest_points(sampled, truth.vertices, truth.faces)
    completeness, index, feet = closest_points(truth.points, vertices, faces)
    normals = _interpolated(_corner_normals(vertices, faces), vertices, faces, index, feet)
    predicted = None
    if deviation is not None:
        predicted = _interpolated(deviation[faces], vertices, faces, owners, sampled)
    covered, parts = completeness <= 3.0 * tolerance, truth.parts
    angles = _angles_deg(normals[covered], truth.normals[covered])
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return Evaluation(
        float(np.mean(covered)),
        *_statistics(accuracy),
        tuple(sampled[accuracy.argmax()].tolist()),
        *_statistics(completeness),
        tuple(truth.points[completeness.argmax()].tolist()),
        0.5 * float(accuracy.mean() + completeness.mean()),
        float(max(accuracy.max(), completeness.max())),
        _f_score(accuracy, completeness, tolerance),
        float(angles.mean()) if len(angles) else None,
        float(np.quantile(angles, 0.95)) if len(angles) else None,
        _calibration(accuracy, predicted),
        bool(mesh.is_watertight and mesh.is_winding_consistent),
        int(mesh.euler_number),
        truth.euler_characteristic if truth.closed else None,
        int(parts.max()) + 1,
        len(np.unique(parts[covered])),
        hidden_area(truth.vertices, truth.faces),
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


def _statistics(distance) -> tuple[float, float, float, float]:
    """Mean, rms, 95th percentile and maximum."""
    return (
        float(distance.mean()),
        float(np.sqrt(np.mean(distance**2))),
        float(np.quantile(distance, 0.95)),
        float(distance.max()),
    )


def _corner_normals(vertices, faces) -> np.ndarray:
    """(f, 3, 3) normals at the corners of triangles: the vertex normal, except at a vertex on an
    edge of the surface, where it is the triangle's own."""
    flat = igl.per_face_normals(vertices, faces, np.zeros(3))[:, None]
    smooth = igl.per_vertex_normals(vertices, faces, _BY_AREA)[faces]
    on_edge = np.zeros(len(vertices), bool)
    # A vertex of degenerate triangles alone has no normal: NaN is not above the limit.
    # Normals of a vertex and of its triangles that differ by 20 degrees are at an edge.
    on_edge[faces[~((smooth * flat).sum(axis=2) >= np.cos(np.deg2rad(20.0)))]] = True
    return np.where(on_edge[faces][..., None], flat, smooth)


def _interpolated(values, vertices, faces, index, points) -> np.ndarray:
    """Values at the corners of triangles (f, 3, ...), interpolated at points (n, 3) in the
    triangles ``index`` (n,)."""
    weights = _barycentric(points, vertices[faces[index]])
    weights = weights.reshape(weights.shape + (1,) * (values.ndim - 2))
    mean: np.ndarray = (weights * values[index]).sum(axis=1)
    return mean


def _barycentric(points, corners) -> np.ndarray:
    """(n, 3) barycentric coordinates of points (n, 3) in triangles (n, 3, 3); thirds where the
    triangle is degenerate."""
    weights = igl.barycentric_coordinates(points, *corners.transpose(1, 0, 2))
    return np.where(np.isfinite(weights).all(axis=1, keepdims=True), weights, 1.0 / 3.0)


def _angles_deg(a, b) -> np.ndarray:
    """(n,) angles between vectors, degrees."""
    cosine = (a * b).sum(axis=1) / np.maximum(
        np.sqrt((a**2).sum(axis=1) * (b**2).sum(axis=1)), np.finfo(float).tiny
    )
    return np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0)))
