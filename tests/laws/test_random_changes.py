"""An atlas under random changes stays sound: all that ``validate`` asks for holds after each, and
what it knows at the end is what its touches teach in the same order without the rest."""

from dataclasses import replace

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
    run_state_machine_as_test,
)

from tests.explored import explored, learned, saved, touched_again
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas, TouchStatus, load_atlas, save_atlas

# A free-form body, and one of faces with edges.
BODIES = {"bottle": lambda: explored("bottle"), "block": lambda: explored_sharp("block")}
# Touches that an atlas learns at most: more of them take longer, and change nothing else.
MOST = 10


class RandomChanges(RuleBasedStateMachine):
    """Touches of one body in random order, some of them again, with refused ones, saving and
    loading, and looking for faces between them."""

    folder = None

    @initialize(name=st.sampled_from(sorted(BODIES)), seed=st.integers(0, 999))
    def begin(self, name, seed):
        whole, rng = BODIES[name](), np.random.default_rng(seed)
        self.touches = [*whole.touches, *(touched_again(touch, rng) for touch in whole.touches)]
        rng.shuffle(self.touches)
        self.atlas, self.learned, self.finished = Atlas(whole.atlas.tolerance), [], False

    @rule()
    @precondition(lambda self: len(self.learned) < MOST)
    def add(self):
        before, touch = self.atlas.point_count, self.touches.pop()
        change = self.atlas.add(touch)
        self.learned.append(touch)
        points = 0 if change.refused else sum(len(c.points) for c in touch.contours)
        assert self.atlas.point_count == before + points

    @rule()
    @precondition(
        lambda self: self.learned and (self.learned[-1].contours or self.learned[-1].way is None)
    )
    def repeat(self):
        self.refused(self.learned[-1])

    @rule()
    def lose(self):
        lost = replace(self.touches[-1], contours=(), status=TouchStatus.NO_CONTACT, way=None)
        self.refused(lost)

    @rule()
    def miss(self):
        """A way through where the next touch has its contact takes nothing but surface away."""
        before, touch = self.atlas.point_count, self.touches[-1]
        beyond = touch.way + 2.0 * (touch.way[1] - touch.way[0]) * [[0.0], [1.0]]
        missed = replace(touch, contours=(), status=TouchStatus.NO_CONTACT, way=beyond)
        assert self.atlas.add(missed).refused and self.atlas.point_count == before
        self.learned.append(missed)

    @rule()
    def save_and_load(self):
        path = self.folder / "atlas.npz"
        save_atlas(path, self.atlas)
        self.atlas = load_atlas(path)
        assert saved(self.atlas, self.folder / "again.npz") == path.read_bytes()

    @rule()
    def finish(self):
        self.atlas.finish()
        self.finished = True

    def refused(self, touch):
        """A refused touch is counted, and changes nothing else."""
        before = self.atlas.point_count, self.atlas.known_body
        assert self.atlas.add(touch).refused
        assert (self.atlas.point_count, self.atlas.known_body) == before
        self.learned.append(touch)

    def teardown(self):
        self.atlas.validate()
        assert self.atlas.touches == len(self.learned)
        if not self.finished:
            again = learned(self.learned, self.atlas.tolerance)
            one = saved(self.atlas, self.folder / "one.npz")
            assert saved(again, self.folder / "other.npz") == one


def test_an_atlas_under_random_changes_is_sound_and_follows_from_its_touches(tmp_path):
    class InFolder(RandomChanges):
        folder = tmp_path

    run_state_machine_as_test(
        InFolder,
        settings=settings(
            max_examples=5,
            stateful_step_count=12,
            deadline=None,
            derandomize=True,
            database=None,
            suppress_health_check=list(HealthCheck),
        ),
    )
