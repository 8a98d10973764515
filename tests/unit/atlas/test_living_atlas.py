"""An atlas under random changes: added to, merged, split, saved and loaded, it stays sound."""

from collections import Counter
from copy import deepcopy
from functools import lru_cache

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
from touchatlas.atlas.atlas import Atlas
from touchatlas.atlas.store import load_atlas, save_atlas

OBJECTS = ("cube", "sphere", "torus", "bottle")


@lru_cache
def finished(name: str) -> Atlas:
    """An explored atlas, refitted and simplified."""
    atlas = Atlas(explored(name).atlas.tolerance)
    for touch in explored(name).touches:
        atlas.add(touch)
    atlas.refit_all()
    atlas.simplify()
    return atlas


class LivingAtlas(RuleBasedStateMachine):
    """Random touches of one object in random order, and what else can happen to an atlas.

    It begins empty, or explored; then the object is touched at the same places again.
    """

    folder = None
    names = OBJECTS
    done: Counter[tuple[str, str]] = Counter()

    @initialize(data=st.data(), seed=st.integers(0, 999), known=st.booleans())
    def begin(self, data, seed, known):
        self.name = data.draw(st.sampled_from(self.names))
        whole = explored(self.name)
        rng = np.random.default_rng(seed)
        self.touches = list(whole.touches)
        if known:
            self.touches = [touched_again(touch, rng) for touch in self.touches]
        rng.shuffle(self.touches)
        self.atlas = deepcopy(whole.atlas) if known else Atlas(whole.atlas.tolerance)

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

    @rule(choice=st.floats(0, 1, exclude_max=True))
    @precondition(lambda self: len(self.atlas) > 1)
    def merge(self, choice):
        edges = sorted(self.atlas.graph.edges)
        if edges:
            change = self.atlas.merge(*edges[int(choice * len(edges))])
            assert bool(change.refused) != bool(change.merged)
            self.sound("merge", change.merged)

    @rule(choice=st.floats(0, 1, exclude_max=True))
    @precondition(lambda self: len(self.atlas))
    def split(self, choice):
        nodes = sorted(self.atlas.graph)
        change = self.atlas.split(nodes[int(choice * len(nodes))])
        assert bool(change.refused) != bool(change.split)
        self.sound("split", change.split)

    @rule()
    def simplify(self):
        before = set(self.atlas.graph)
        change = self.atlas.simplify()
        assert set(self.atlas.graph) == (before | set(change.added)) - set(change.removed)
        self.sound("simplify", change.merged)

    @rule()
    def learn_residuals(self):
        count = self.atlas.learn_residuals()
        assert count == len(self.atlas.table.residuals)
        self.sound("learn_residuals", count)

    @rule()
    def save_and_load(self):
        path = self.folder / "atlas.npz"
        save_atlas(path, self.atlas)
        again = load_atlas(path)
        save_atlas(self.folder / "again.npz", again)
        assert (self.folder / "again.npz").read_bytes() == path.read_bytes()
        self.atlas = again
        self.sound("save", again.table.residuals)

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


def run(folder, examples: int, steps: int, names=OBJECTS) -> Counter:
    LivingAtlas.folder, LivingAtlas.names, LivingAtlas.done = folder, names, Counter()
    run_state_machine_as_test(
        LivingAtlas,
        settings=settings(
            max_examples=examples,
            stateful_step_count=steps,
            deadline=None,
            derandomize=True,
            database=None,
            suppress_health_check=list(HealthCheck),
        ),
    )
    return LivingAtlas.done


@pytest.mark.parametrize(("names", "examples"), [(("cube",), 3), (OBJECTS[1:], 4)])
def test_random_changes_leave_a_sound_atlas(names, examples, tmp_path):
    run(tmp_path, examples, 12, names)


@pytest.mark.slow
def test_ten_thousand_random_changes_leave_a_sound_atlas(tmp_path):
    done = run(tmp_path, 200, 50)
    for name in OBJECTS:
        assert done[name, "merge"] and done[name, "split"] and done[name, "simplify"]
    assert any(done[name, "learn_residuals"] for name in OBJECTS)


@pytest.mark.parametrize("name", ["sphere", "bottle", "torus"])
def test_merging_keeps_the_surface_and_its_topology(name):
    """One polynomial holds both within the noise, so the surface stays within a few of it."""
    whole = explored(name)
    points = np.concatenate([c.points for t in whole.touches[::5] for c in t.contours])
    before, after = whole.atlas.blend(points), finished(name).blend(points)
    assert len(finished(name)) <= len(whole.atlas)
    assert after.known.all()
    difference = np.abs(after.distance - before.distance)
    assert np.sqrt(np.mean(difference**2)) < np.median(whole.atlas.table.noise)
    assert finished(name).euler_characteristic() == whole.atlas.euler_characteristic()
    finished(name).validate()


def test_split_then_merge_keeps_coverage_and_validates():
    atlas = deepcopy(finished("sphere"))
    points = np.concatenate([c.points for t in explored("sphere").touches for c in t.contours])
    change = next(c for c in map(atlas.split, sorted(atlas.graph)) if not c.refused)
    atlas.validate()
    assert not set(change.removed) & set(atlas.graph)
    assert atlas.blend(points).known.all() and atlas.closed
    atlas.simplify()
    atlas.validate()
    assert atlas.blend(points).known.all() and atlas.closed


def test_parts_of_a_face_stay_within_its_edges():
    """The core of a face reaches beyond its edges: some of seven smaller ones would lie there."""
    for face in sorted(finished("cube").graph)[:3]:
        atlas = deepcopy(finished("cube"))
        assert not atlas.split(face).refused
        for change in (Atlas.refit_all, Atlas.simplify):
            change(atlas)
            atlas.validate()
            assert atlas.closed and atlas.euler_characteristic() == 2


def test_residuals_leave_the_equations_as_they_are():
    """What a residual holds is not left out of the surface, but of the sums it still is."""
    atlas = deepcopy(explored("torus").atlas)
    atlas.refit_all()
    assert atlas.learn_residuals()
    atlas.validate()
    rng = np.random.default_rng(0)
    for touch in explored("torus").touches[:5]:
        assert not atlas.add(touched_again(touch, rng)).refused
        atlas.validate()
    atlas.refit_all()
    atlas.validate()


def test_a_refitted_torus_is_closed():
    """Where three radical planes meet along a line that runs beside the surface is no gap."""
    atlas = deepcopy(explored("torus").atlas)
    atlas.refit_all()
    assert not atlas.gaps and atlas.closed and atlas.euler_characteristic() == 0


def test_patches_that_do_not_meet_are_not_merged():
    atlas = explored("torus").atlas
    first = min(atlas.graph)
    second = next(i for i in atlas.graph if i not in atlas.neighbours[first] and i != first)
    count = len(atlas)
    assert "sheet" in atlas.merge(first, second).refused
    assert len(atlas) == count
    with pytest.raises(KeyError, match="no patch"):
        atlas.merge(first, 10**6)
    with pytest.raises(KeyError, match="no patch"):
        atlas.split(-1)
