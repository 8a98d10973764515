"""Options of a run and of the judge: what is none is refused in one sentence, where it is given."""

import pytest

from touchatlas.planner import PlannerOptions
from touchatlas.sim import RunOptions
from touchatlas.sim.judge.truth import EvaluateOptions


@pytest.mark.parametrize("seed", [None, 1.5, True, -1, "3"])
def test_a_seed_is_a_whole_number(seed):
    with pytest.raises(ValueError, match="seed is .*; it must be a whole number, 0 or more"):
        RunOptions(seed=seed)


@pytest.mark.parametrize("samples", [0, 2.5, True, None, "x", float("nan"), [1]])
def test_samples_of_the_judge_are_a_whole_number(samples):
    with pytest.raises(ValueError, match="samples is .*; it must be a whole number, 1 or more"):
        EvaluateOptions(samples=samples)


@pytest.mark.parametrize("wrong", [[1], {}, 3, None])
def test_names_of_planners_are_words(wrong):
    with pytest.raises(ValueError, match="it must be one of"):
        PlannerOptions(name=wrong)


@pytest.mark.parametrize("wrong", [[1], {}, 3])
def test_units_are_words(wrong):
    with pytest.raises(ValueError, match="unit is .*; it must be one of"):
        RunOptions(unit=wrong)
