"""Zeros of a polynomial that are not the sheet of its samples."""

import numpy as np
import pytest

from touchatlas.atlas.field.patch_values import on_wrong_side


@pytest.mark.parametrize(
    ("x", "z", "distance", "wrong"),
    [
        # Deep inside, though the value says outside: the zero is another sheet.
        (0.2, -0.7, 0.2, True),
        (0.2, -0.7, -0.6, False),
        (0.2, 0.7, -0.2, True),
        # A patch that turns by 60 degrees rises by 0.43 at 0.75 from its origin.
        (0.75, -0.4, 0.1, False),
        (0.75, -0.7, 0.1, True),
        # An origin may lie a little off its patch.
        (0.0, 0.05, -0.02, False),
    ],
)
def test_steeply_above_or_below_a_patch_the_side_is_known(x, z, distance, wrong):
    for angle in (0.0, 1.0, 2.5):
        point = np.array([x * np.cos(angle), x * np.sin(angle), z])
        assert on_wrong_side(point, distance) == wrong


def test_points_about_a_cap_that_turns_by_sixty_degrees_are_on_their_side():
    """Points beside a sphere; its core reaches to sin 60 degrees, which is scaled to 0.75."""
    rng = np.random.default_rng(0)
    turn, angle = np.arccos(rng.uniform(0.5, 1.0, 1000)), rng.uniform(0.0, 2.0 * np.pi, 1000)
    normal = np.stack(
        [np.sin(turn) * np.cos(angle), np.sin(turn) * np.sin(angle), np.cos(turn)], axis=1
    )
    offset = rng.uniform(-0.3, 0.3, 1000)
    scale = 0.75 / np.sin(np.pi / 3.0)
    points = scale * ((1.0 + offset)[:, None] * normal - [0.0, 0.0, 1.0])
    assert not on_wrong_side(points, scale * offset).any()
