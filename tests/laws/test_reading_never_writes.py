"""Reading never writes: whatever is asked of an atlas, in any order, the saved bytes stay."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.explored import explored, learned, saved
from tests.kept import kept_once
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas, doubts, extract_surface, save_atlas
from touchatlas.planner import Planner

POINTS = np.random.default_rng(0).uniform(-40.0, 40.0, (50, 3))
READINGS = {
    "ask": lambda atlas, planner, path: planner.ask(atlas),
    "ask another planner": lambda atlas, planner, path: Planner(*START).ask(atlas),
    "blend": lambda atlas, planner, path: atlas.blend(POINTS),
    "body": lambda atlas, planner, path: atlas.body.at(POINTS),
    "doubts": lambda atlas, planner, path: doubts(atlas),
    "faces": lambda atlas, planner, path: atlas.faces(),
    "forecast": lambda atlas, planner, path: planner.forecast(atlas),
    "rims": lambda atlas, planner, path: atlas.rims.unsure(0.1),
    "surface": lambda atlas, planner, path: extract_surface(atlas, 8.0),
    "validate": lambda atlas, planner, path: atlas.validate(),
    "save": lambda atlas, planner, path: save_atlas(path, atlas),
}
START = np.array([0.0, 0.0, 50.0]), np.array([0.0, 0.0, 1.0])
BODIES = {
    "bottle": lambda: explored("bottle"),
    "block": lambda: explored_sharp("block"),
}


# Touches by which the block has faces with edges between them, and the bottle a surface.
FEW = {"bottle": 2, "block": 4}


@kept_once
def begun(name: str) -> Atlas:
    """A copy of an atlas of few touches: a free-form body, or one with edges."""
    whole = BODIES[name]()
    return learned(whole.touches[: FEW[name]], whole.atlas.tolerance)


@pytest.mark.parametrize("name", BODIES)
@settings(
    max_examples=3,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=list(HealthCheck),
)
@given(readings=st.lists(st.sampled_from(sorted(READINGS)), min_size=1, max_size=5))
def test_what_is_saved_does_not_depend_on_what_was_read(name, readings, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reading")
    atlas, planner = begun(name), Planner(*START)
    before = saved(atlas, folder / "before.npz")
    for reading in readings:
        READINGS[reading](atlas, planner, folder / "other.npz")
    assert saved(atlas, folder / "after.npz") == before


@pytest.mark.parametrize("name", BODIES)
def test_what_is_learned_does_not_depend_on_what_was_read(name, tmp_path):
    """Few touches give the same bytes, whether all was read between them or nothing."""
    whole = BODIES[name]()
    quiet, read = Atlas(whole.atlas.tolerance), Atlas(whole.atlas.tolerance)
    for touch in whole.touches[: FEW[name]]:
        quiet.add(touch)
        read.add(touch)
        for reading in READINGS.values() if len(read) else ():
            reading(read, Planner(*START), tmp_path / "other.npz")
    assert saved(read, tmp_path / "read.npz") == saved(quiet, tmp_path / "quiet.npz")
