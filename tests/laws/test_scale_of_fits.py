"""The scale of fits is that of the noise, whatever the tolerance."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import explored, learned
from touchatlas.atlas import Atlas, load_atlas, save_atlas

POINTS = np.random.default_rng(0).uniform(-40.0, 40.0, (500, 3))


def test_what_is_learned_does_not_depend_on_the_tolerance():
    """Noise of 0.02: five deviations are 0.1."""
    touches = explored("sphere").touches[:4]
    known = learned(touches, 0.1, 0.1).blend(POINTS)
    assert known.known.any()
    for tolerance in (0.03, 1.0, 10.0):
        atlas = learned(touches, tolerance)
        assert atlas.scale == pytest.approx(0.1)
        np.testing.assert_allclose(atlas.blend(POINTS).distance, known.distance, rtol=1e-9)


def test_without_noise_the_scale_is_the_tolerance():
    touches = [
        replace(touch, contours=tuple(replace(c, noise_std=0.0) for c in touch.contours))
        for touch in explored("sphere").touches[:1]
    ]
    assert learned(touches, 0.25).scale == 0.25


def test_an_atlas_that_was_saved_empty_takes_its_scale_from_the_first_touch(tmp_path):
    touches = explored("sphere").touches[:2]
    save_atlas(tmp_path / "empty.npz", Atlas(2.0))
    again = load_atlas(tmp_path / "empty.npz")
    for touch in touches:
        again.add(touch)
    assert again.scale == learned(touches, 2.0).scale == pytest.approx(0.1)
    save_atlas(tmp_path / "given.npz", Atlas(2.0, scale=0.3))
    assert load_atlas(tmp_path / "given.npz").scale == 0.3


@pytest.mark.parametrize("scale", [-1.0, 0.0, float("nan")])
def test_a_scale_that_is_none_is_named(scale):
    with pytest.raises(ValueError, match="scale is"):
        Atlas(0.1, scale=scale)
