"""Which places lie among samples: those on the same part of the surface as these, and no others."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from touchatlas.atlas.body.thinned_samples import ThinnedSamples

REACH = 1.0


@dataclass
class OneFace:
    """All samples are those of one face, with or without sharp edges."""

    normals: np.ndarray
    is_sharp: bool
    rounded: np.ndarray = field(default_factory=lambda: np.zeros(0, int))

    @property
    def of(self) -> np.ndarray:
        return np.zeros(len(self.normals), int)

    def __len__(self) -> int:
        return 1


def among(points, normals, at, along, is_sharp=False):
    thinned = ThinnedSamples(points, OneFace(normals, is_sharp), REACH)
    return thinned.surround(at, along)


def plane(seed: int = 0):
    """Samples (900, 3) all over a square of six reaches, and their normals."""
    points = np.random.default_rng(seed).uniform(-3.0, 3.0, (900, 3)) * [1.0, 1.0, 0.0]
    return points, np.tile([0.0, 0.0, 1.0], (900, 1))


@pytest.mark.parametrize("is_sharp", [False, True])
def test_places_below_a_plane_do_not_lie_among_its_samples(is_sharp):
    """Down to a tenth of the reach a surface may bend to these; from a third on it cannot."""
    points, normals = plane()
    at = np.stack([np.zeros(12), np.zeros(12), -np.linspace(0.0, 0.9, 12)], axis=1)
    for side in (1.0, -1.0):
        found = among(points, normals, at, side * normals[:12], is_sharp)
        assert not found[at[:, 2] < -0.33].any()
        assert found[0] == (side > 0.0)


@pytest.mark.parametrize("is_sharp", [False, True])
def test_places_of_a_ball_lie_among_its_samples(is_sharp):
    """Also where the samples within reach are turned by 60 degrees."""
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    for radius in (1.0, 3.0):
        found = among(radius * normals[:1500], normals[:1500], radius * normals, normals, is_sharp)
        assert found.mean() > 0.99


@pytest.mark.parametrize("turn", [30.0, 60.0, 90.0, -60.0, -90.0])
def test_places_beside_an_edge_lie_among_the_samples_of_both_sides(turn):
    """Two planes meet at the y axis, convex or concave; the places are close to it."""
    points, normals = plane(2)
    cosine, sine = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    bend = np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])
    far = points[:, 0] > 0.0
    points[far], normals[far] = points[far] @ bend, normals[far] @ bend
    at = np.stack([np.full(20, -0.02), np.linspace(-1.0, 1.0, 20), np.zeros(20)], axis=1)
    assert among(points, normals, at, np.tile([0.0, 0.0, 1.0], (20, 1)), is_sharp=True).all()


def test_a_shallow_wave_between_lines_of_samples_is_known():
    """Its slope is 0.35 at most, and lines are half a wave apart: the chord from one to the next is
    off that of an arc by as much as the slope where they lie on its flanks."""
    rng = np.random.default_rng(4)
    lines = np.repeat(np.arange(-4.0, 4.1, 0.7) + 0.2, 150)

    def wave(x, y):
        turn = 2.0 * np.pi / 1.4
        up = np.stack([-0.35 * np.cos(turn * x), np.zeros_like(x), np.ones_like(x)], axis=1)
        points = np.stack([x, y, 0.35 / turn * np.sin(turn * x)], axis=1)
        return points, up / np.linalg.norm(up, axis=1)[:, None]

    at = wave(rng.uniform(-2.0, 2.0, 300), rng.uniform(-1.5, 1.5, 300))
    assert among(*wave(lines, rng.uniform(-3.0, 3.0, len(lines))), *at).mean() > 0.98
