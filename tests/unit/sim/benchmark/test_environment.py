"""The environment of Gymnasium: its own checker, equal seeds, rewards by a second route."""

import warnings

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402

from touchatlas.sim.benchmark import NAME  # noqa: E402
from touchatlas.sim.study.course import MachineTime  # noqa: E402
from touchatlas.sim.study.oracle import errors  # noqa: E402

FEW = {"objects": ("sphere",), "tolerance": 3e-2, "max_touches": 4, "points": 300}


@pytest.mark.parametrize("action", ["candidate", pytest.param("place", marks=pytest.mark.slow)])
def test_gymnasium_finds_no_fault(action):
    environment = gymnasium.make(NAME, action=action, **FEW).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(environment)


def test_a_reward_is_the_share_that_came_within_the_tolerance_over_machine_seconds():
    """Second route: a machine that takes a second a touch, and the truth itself."""
    machine = MachineTime(scan=1e9, travel=1e9, touch=1.0)
    environment = gymnasium.make(NAME, machine=machine, **FEW)
    observed, info = environment.reset(seed=3)
    inner, total, seconds, over = environment.unwrapped, info["share"], info["seconds"], False
    while not over:
        assert inner.observation_space.contains(observed)
        observed, reward, terminated, truncated, info = environment.step(0)
        total += reward * (info["seconds"] - seconds)
        seconds, over = info["seconds"], terminated or truncated
    near = errors(inner.atlas, inner._truth) <= inner.atlas.tolerance
    assert total == pytest.approx(near.mean(), abs=1e-9)
    assert seconds == pytest.approx(len(inner.planner._attempts.tried), rel=1e-6)
    assert 0.0 <= observed["budget"][0] <= 1.0 - 1.0 / FEW["max_touches"]


def test_samples_and_candidates_lie_on_the_object():
    """A ball of radius 33, whose start is its top; the noise is 2e-4 of the diagonal."""
    environment = gymnasium.make(NAME, **FEW)
    observed, _ = environment.reset(seed=5)
    inner = environment.unwrapped
    there = observed["samples"][(observed["samples"] != 0.0).any(axis=1)]
    points = inner._start + inner._object.diagonal * there[:, :3]
    assert np.linalg.norm(points, axis=1) == pytest.approx(33.0, abs=0.15)
    assert np.linalg.norm(there[:, 3:], axis=1) == pytest.approx(1.0, abs=1e-3)
    lines = observed["candidates"][observed["mask"].astype(bool)]
    assert len(lines) and (lines[:, 8] > 0.0).all()  # none where a touch was


def test_wrong_arguments_are_refused():
    with pytest.raises(ValueError, match="action is 'both'; it must be candidate or place"):
        gymnasium.make(NAME, action="both")
    with pytest.raises(ValueError, match="objects are 'sphere'; give a list"):
        gymnasium.make(NAME, objects="sphere")
