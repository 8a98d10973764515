"""Laws are said in numbers whose deviations are right."""

from dataclasses import replace

import numpy as np
import pytest

from touchatlas.atlas.pieces.fit_piece import fit_piece
from touchatlas.atlas.pieces.kinds import Kind
from touchatlas.atlas.pieces.laws import law_of
from touchatlas.sim.study.cases import random_rotation

NOISE = 0.02


def law(kind, points, normals, rng):
    noisy = points + NOISE * rng.normal(size=points.shape)
    return law_of(fit_piece(kind, noisy, normals, NOISE), noisy, NOISE)


def test_radius_and_centre_of_a_ball_are_as_sure_as_predicted():
    """Forty draws of a cap: the ratios have a mean square of one within 3 sqrt(2 / 40)."""
    rng, ratios = np.random.default_rng(0), []
    for _ in range(40):
        u, v = rng.uniform(-0.6, 0.6, (2, 300))
        normals = np.stack([np.sin(u), np.cos(u) * np.sin(v), np.cos(u) * np.cos(v)], axis=1)
        numbers = law(Kind.SPHERE, 9.0 * normals + [1.0, 2.0, 3.0], normals, rng).numbers
        off = np.linalg.norm(np.subtract(numbers["centre"], [1.0, 2.0, 3.0]))
        ratio = (numbers["radius"] - 9.0) / numbers["radius_std"]
        ratios.append((ratio**2, (off / numbers["centre_std"]) ** 2 / 3.0))
    assert np.abs(np.mean(ratios, axis=0) - 1.0).max() < 3.0 * np.sqrt(2.0 / 40)


@pytest.mark.parametrize(("side", "words"), [(1.0, "cylinder"), (-1.0, "hollow cylinder")])
def test_a_turned_cylinder_has_its_radius_and_axis(side, words):
    rng = np.random.default_rng(1)
    turn = random_rotation(rng)
    u, along = rng.uniform(0.0, 6.0, 400), rng.uniform(-8.0, 8.0, 400)
    normals = np.stack([np.sin(u), np.cos(u), 0 * u], axis=1)
    points = 5.0 * normals + along[:, None] * np.array([0.0, 0.0, 1.0])
    found = law(Kind.CYLINDER, points @ turn.T, side * normals @ turn.T, rng)
    assert found.words.startswith(f"{words}, radius 5.0")
    assert abs(found.numbers["radius"] - 5.0) < 4.0 * found.numbers["radius_std"]
    off = np.cross(found.numbers["axis"], turn[:, 2])
    assert np.linalg.norm(off) < 4.0 * found.numbers["axis_std"] * np.sqrt(2.0)


@pytest.mark.parametrize(("side", "words"), [(1.0, "torus"), (-1.0, "hollow torus")])
def test_a_turned_torus_has_its_radii_axis_and_centre(side, words):
    rng = np.random.default_rng(1)
    turn, (u, v) = random_rotation(rng), rng.uniform(0.0, 2.5, (2, 400))
    radial = np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    normals = np.cos(v)[:, None] * radial + np.sin(v)[:, None] * np.array([0.0, 0.0, 1.0])
    points = (9.0 * radial + 3.0 * normals + [1.0, 2.0, 3.0]) @ turn.T
    found = law(Kind.TORUS, points, side * normals @ turn.T, rng)
    numbers = found.numbers
    assert found.words.startswith(f"{words}, radii ")
    assert abs(numbers["radius"] - 9.0) < 4.0 * numbers["radius_std"] < 0.1
    assert abs(numbers["tube_radius"] - 3.0) < 4.0 * numbers["tube_radius_std"] < 0.1
    off = np.cross(numbers["axis"], turn[:, 2])
    assert np.linalg.norm(off) < 4.0 * numbers["axis_std"] * np.sqrt(2.0)
    away = np.linalg.norm(numbers["centre"] - turn @ [1.0, 2.0, 3.0])
    assert away < 4.0 * numbers["centre_std"] * np.sqrt(3.0)


def test_a_plane_has_its_normal_and_level():
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-5.0, 5.0, (2, 200))
    points = np.stack([x, y, 7.0 + 0 * x], axis=1)
    found = law(Kind.PLANE, points, np.tile([0.0, 0.0, 1.0], (200, 1)), rng)
    assert abs(found.numbers["level"] - 7.0) < 4.0 * found.numbers["level_std"]
    assert np.hypot(*found.numbers["normal"][:2]) < 4.0 * found.numbers["normal_std"] * np.sqrt(2)
    assert found.words.startswith("plane, normal (0.00")


def test_a_quadric_has_its_curvatures():
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-5.0, 5.0, (2, 400))
    normals = np.stack([-0.1 * x, 0.06 * y, 1.0 + 0 * x], axis=1)
    points = np.stack([x, y, 0.05 * x * x - 0.03 * y * y], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    piece = fit_piece(Kind.QUADRIC, points, normals, NOISE)
    found = law_of(piece, points, NOISE).numbers
    # The middle is the sample nearest to the mean: the saddle's curvatures fall off by 2 % there.
    assert abs(found["k1"] - 0.1) < 0.002 and abs(found["k2"] + 0.06) < 0.002


def test_kind_and_words_agree_where_no_cylinder_fits():
    """A cylinder that is flat to within its noise is a quadric in kind, words and numbers."""
    rng = np.random.default_rng(5)
    x, y = rng.uniform(-5.0, 5.0, (2, 200))
    points, normals = np.stack([x, y, 0 * x], axis=1), np.tile([0.0, 0.0, 1.0], (200, 1))
    flat = replace(fit_piece(Kind.QUADRIC, points, normals, NOISE), kind=Kind.CYLINDER)
    found = law_of(flat, points, NOISE)
    assert found.kind == "quadric" and found.words.startswith("quadric, ")
    assert found.numbers.keys() == {"k1", "k2", "middle"}


def test_a_quartic_has_no_law():
    rng = np.random.default_rng(4)
    x, y = rng.uniform(-5.0, 5.0, (2, 100))
    points = np.stack([x, y, 0.001 * x**4], axis=1)
    piece = fit_piece(Kind.QUARTIC, points, np.tile([0.0, 0.0, 1.0], (100, 1)), NOISE)
    with pytest.raises(ValueError, match="a quartic has no law"):
        law_of(piece, points, NOISE)
