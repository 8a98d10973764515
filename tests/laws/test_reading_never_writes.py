"""Reading never writes: whatever is asked of an atlas, in any order, the saved bytes stay."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.explored import ONE_A_TOUCH, bumpy, explored
from tests.sharp import explored_sharp
from touchatlas.atlas import Atlas, extract_surface, save_atlas
from touchatlas.planner import FrontierPlanner

POINTS = np.random.default_rng(0).uniform(-40.0, 40.0, (50, 3))
READINGS = {
    "ask": lambda atlas, planner, path: planner.ask(atlas),
    "ask another planner": lambda atlas, planner, path: FrontierPlanner(*START).ask(atlas),
    "blend": lambda atlas, planner, path: atlas.blend(POINTS),
    "graph": lambda atlas, planner, path: atlas.graph,
    "corners": lambda atlas, planner, path: atlas.corners,
    "gaps": lambda atlas, planner, path: atlas.gaps,
    "closed": lambda atlas, planner, path: atlas.closed,
    "coverage": lambda atlas, planner, path: atlas.outlines_closed(),
    "deviation": lambda atlas, planner, path: atlas.predicted_deviation(),
    "euler": lambda atlas, planner, path: atlas.euler_characteristic(),
    "patch": lambda atlas, planner, path: atlas.patch(min(atlas.graph)),
    "surface": lambda atlas, planner, path: extract_surface(atlas, 4.0),
    "validate": lambda atlas, planner, path: atlas.validate(),
    "save": lambda atlas, planner, path: save_atlas(path, atlas),
}
START = np.array([0.0, 0.0, 50.0]), np.array([0.0, 0.0, 1.0])


def half_explored(name: str) -> Atlas:
    """An atlas with open outlines, one with edges, or one with residuals."""
    if name == "bumpy":
        return bumpy().atlas
    whole = explored_sharp("wall", max_touches=20) if name == "wall" else explored(name, 1.0, 25)
    return whole.atlas


def saved(atlas: Atlas, path) -> bytes:
    save_atlas(path, atlas)
    return path.read_bytes()


@pytest.mark.parametrize("name", ["torus", "wall", "bumpy"])
@settings(
    max_examples=12,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=list(HealthCheck),
)
@given(readings=st.lists(st.sampled_from(sorted(READINGS)), min_size=1, max_size=8))
def test_what_is_saved_does_not_depend_on_what_was_read(name, readings, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reading")
    atlas, planner = half_explored(name), FrontierPlanner(*START)
    before = saved(atlas, folder / "before.npz")
    for reading in readings:
        READINGS[reading](atlas, planner, folder / "other.npz")
    assert saved(atlas, folder / "after.npz") == before


@pytest.mark.parametrize("name", ["torus", "wall"])
def test_what_is_learned_does_not_depend_on_what_was_read(name, tmp_path):
    """Twenty touches give the same bytes, whether all was read between them or nothing."""
    whole = explored_sharp(name, max_touches=20) if name == "wall" else explored(name, 1.0, 25)
    quiet, read = Atlas(0.1, ONE_A_TOUCH), Atlas(0.1, ONE_A_TOUCH)
    for touch in whole.touches[:20]:
        quiet.add(touch)
        read.add(touch)
        for reading in READINGS.values() if len(read) else ():
            reading(read, FrontierPlanner(*START), tmp_path / "other.npz")
    assert saved(read, tmp_path / "read.npz") == saved(quiet, tmp_path / "quiet.npz")
