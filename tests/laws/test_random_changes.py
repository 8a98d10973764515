"""An atlas under random changes stays sound: all that ``validate`` asks for holds after each."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
    run_state_machine_as_test,
)

from tests.explored import explored, touched_again
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas, load_atlas, save_atlas

# A body with edges, a closed ball, and two that are open at a frontier.
OBJECTS = {
    "wall": lambda: explored_sharp("wall"),
    "sphere": lambda: explored("sphere"),
    "torus": lambda: explored("torus", max_touches=50),
    "bottle": lambda: explored("bottle", max_touches=40),
}


class RandomChanges(RuleBasedStateMachine):
    """Random touches of one object in random order, and all other changes of an atlas.

    The atlas is empty at first, or explored; then the object is touched at the same places again.
    """

    folder = None
    names = tuple(OBJECTS)
    done: Counter[tuple[str, str]] = Counter()

    @initialize(data=st.data(), seed=st.integers(0, 999), known=st.booleans())
    def begin(self, data, seed, known):
        self.name = data.draw(st.sampled_from(self.names))
        whole = OBJECTS[self.name]()
        rng = np.random.default_rng(seed)
        self.touches = list(whole.touches)
        if known:
            self.touches = [touched_again(touch, rng) for touch in self.touches]
        rng.shuffle(self.touches)
        self.atlas = whole.atlas if known else Atlas(whole.atlas.tolerance)

    @rule(count=st.integers(1, 8))
    @precondition(lambda self: self.touches)
    def add(self, count):
        for _ in range(min(count, len(self.touches))):
            before = self.atlas.point_count
            touch = self.touches.pop()
            change = self.atlas.add(touch)
            points = 0 if change.refused else sum(len(c.points) for c in touch.contours)
            assert self.atlas.point_count == before + points
            self.sound("add")

    @rule()
    def learn_residuals(self):
        count = self.atlas.learn_residuals()
        assert 0 <= count <= len(self.atlas)
        self.sound("learn_residuals", count)

    @rule()
    def save_and_load(self):
        path = self.folder / "atlas.npz"
        save_atlas(path, self.atlas)
        again = load_atlas(path)
        save_atlas(self.folder / "again.npz", again)
        assert (self.folder / "again.npz").read_bytes() == path.read_bytes()
        self.atlas = again
        self.sound("save")

    @rule()
    def refit_all(self):
        self.atlas.refit_all()
        self.sound("refit_all")

    @rule()
    def fill(self):
        change = self.atlas.fill()
        assert all(i in self.atlas.graph for i in change.added)
        self.sound("fill", change.added)

    def sound(self, what, changed=True):
        self.done[self.name, what] += bool(changed)
        self.atlas.validate()


def run(folder, examples: int, steps: int, names=tuple(OBJECTS)) -> Counter:
    RandomChanges.folder, RandomChanges.names, RandomChanges.done = folder, names, Counter()
    run_state_machine_as_test(
        RandomChanges,
        settings=settings(
            max_examples=examples,
            stateful_step_count=steps,
            deadline=None,
            derandomize=True,
            database=None,
            suppress_health_check=list(HealthCheck),
        ),
    )
    return RandomChanges.done


@pytest.mark.parametrize(("name", "examples"), [("wall", 3), ("sphere", 2), ("torus", 2)])
def test_random_changes_leave_a_sound_atlas(name, examples, tmp_path):
    run(tmp_path, examples, 12, (name,))


@pytest.mark.slow
def test_ten_thousand_random_changes_leave_a_sound_atlas(tmp_path):
    done = run(tmp_path, 200, 50)
    for name in OBJECTS:
        assert done[name, "add"] and done[name, "fill"] and done[name, "refit_all"]
    assert any(done[name, "learn_residuals"] for name in OBJECTS)
