"""Entering a touch: which touches give a patch."""

import numpy as np
import trimesh

from touchatlas.atlas import Atlas
from touchatlas.planner import Planner
from touchatlas.planner.options import PlannerOptions
from touchatlas.sim import Probe, make_object


def test_a_touch_beside_an_edge_with_coarse_steps_gives_no_patch(tmp_path):
    """The contact is 0.2 from an edge, so that contours are smooth within the least radius, 1.0,
    and the steps are 1.7: one sample of each contour is within."""
    path = tmp_path / "box.ply"
    trimesh.creation.box((50.0, 40.0, 20.0)).export(path)
    obj = make_object(str(path))
    atlas, probe = Atlas(0.2, scale=0.1), Probe(obj, 0.02, np.random.default_rng(0))
    planner = Planner((3.0, 19.8, 10.0), (0.0, 0.0, 1.0), PlannerOptions(step=0.016))
    plan = planner.ask(atlas)
    change = atlas.add(probe(plan))
    assert "3 samples lie within 1 of the contact" in change.refused and not len(atlas)
    atlas.validate()
