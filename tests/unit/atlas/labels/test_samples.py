"""Contours are found again in a pool, and their normals are those of their own side of an edge."""

import numpy as np

from tests.touched import touched, touched_samples
from touchatlas.atlas.labels.samples import contour_samples
from touchatlas.atlas.samples.sample_pool import contours_of_planes


def over_an_edge(step: float, noise: float, rng):
    """A contour over an edge of 90 degrees, its outward normals, and its plane normals."""
    s = step * (np.arange(40) - 19.6)
    points = np.stack([np.minimum(s, 0.0), 0 * s, -np.maximum(s, 0.0)], axis=1)
    points[:, [0, 2]] += noise * rng.normal(size=(40, 2))
    normals = np.where((s < 0.0)[:, None], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0])
    return points, normals, np.tile([0.0, 1.0, 0.0], (40, 1))


def test_normals_beside_an_edge_are_of_one_side():
    """A centred window would give 45 degrees at the edge. The deviation of a slope at the end of
    five samples is 1.1 noise / step: 0.6 degrees; the limit is five of them."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        points, normals, planes = over_an_edge(1.0, 0.01, rng)
        found = contour_samples(points, normals, planes, 0.01).normals
        turn = np.arccos(np.clip((found * normals).sum(axis=1), -1.0, 1.0))
        assert np.rad2deg(turn).max() < 3.0


def test_contours_and_touches_are_told_apart():
    """Three contours a touch, each with a plane of its own, all through the contact."""
    samples = touched_samples("sphere", 30)
    assert samples.contours[-1] == 89 and samples.touches[-1] == 29
    assert (samples.contours // 3 == samples.touches).all()


def test_normals_point_outward_within_their_planes():
    points, _, planes, _ = touched("sphere", 30)
    samples = touched_samples("sphere", 30)
    assert np.abs((samples.normals * planes).sum(axis=1)).max() < 1e-9
    radial = points / np.linalg.norm(points, axis=1)[:, None]
    radial -= (radial * planes).sum(axis=1)[:, None] * planes
    radial /= np.linalg.norm(radial, axis=1)[:, None]
    # Noise 0.02 on steps of 1.67: 0.8 degrees at the end of a window; the limit is six of them.
    assert np.rad2deg(np.arccos((radial * samples.normals).sum(axis=1).clip(-1, 1))).max() < 5.0


def test_the_step_of_a_contour_of_one_sample_does_not_change_when_others_come():
    """It has that of the contour before it. With the median of all steps each touch changed it, and
    nothing that was known of the samples held any more."""
    x = np.array([0.0, 1.0, 2.0, 10.0, 20.0, 25.0, 30.0])
    points, outward = np.column_stack([x, 0.0 * x, 0.0 * x]), np.tile([0.0, 0.0, 1.0], (7, 1))
    planes = np.repeat([[0.0, 1.0, 0.0], [0.6, 0.8, 0.0], [0.0, 1.0, 0.0]], [3, 1, 3], axis=0)
    steps = [contour_samples(points[:n], outward[:n], planes[:n], 0.1).steps for n in (4, 7)]
    assert steps[0].tolist() == [1.0, 1.0, 1.0, 1.0]
    assert steps[1].tolist() == [1.0, 1.0, 1.0, 1.0, 5.0, 5.0, 5.0]


def test_what_is_known_of_the_first_contours_changes_nothing():
    """To the last bit, whether kinks of the first were found or not, with measured normals and
    without."""
    points, outward, planes, noise = touched("sphere", 8)
    numbers = contours_of_planes(planes)
    measured = np.arange(len(points)) % 3 == 0
    for flags in (None, measured):

        def samples_of(count, before=None, flags=flags):
            columns = points[:count], outward[:count], planes[:count], noise
            own = None if flags is None else flags[:count]
            return contour_samples(*columns, numbers=numbers[:count], measured=own, before=before)

        half = int(np.flatnonzero(np.diff(numbers))[11]) + 1
        alone, first = samples_of(len(points)), samples_of(half)
        for _ in range(2):
            after = samples_of(len(points), first)
            for name in ("points", "normals", "contours", "touches", "steps"):
                assert getattr(after, name).tobytes() == getattr(alone, name).tobytes()
            assert len(after.known_hinges) in (0, 12)
            pairs = zip(after.hinges, alone.hinges, strict=True)
            assert all(
                np.array_equal(a, b)
                for one, other in pairs
                for a, b in zip(one, other, strict=True)
            )
            assert len(first.hinges) == 12
        assert len(after.known_hinges) == 12
