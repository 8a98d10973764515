"""Bodies of planes and cylinders, touched over their edges: known from few touches, and sharp."""

from functools import lru_cache

import numpy as np
import pytest
import trimesh

from tests.explored import explore_body
from tests.lawful_meshes import lawful_object
from touchatlas.atlas import Atlas, extract_surface, save_step
from touchatlas.planner import Planner, PlannerOptions, Reason, StopReason, explore
from touchatlas.sim import Probe
from touchatlas.sim.world.mesh_object import MeshObject

NOISE, TOLERANCE = 0.02, 0.2


def body(name: str, scale: float = 1.0) -> MeshObject:
    """A box, or a closed cylinder; 256 chords are within 2e-3 of the circle, a tenth of noise."""
    if name == "box":
        mesh = trimesh.creation.box((60.0, 40.0, 30.0))
    else:
        mesh = trimesh.creation.cylinder(25.0, 30.0, sections=256)
    return MeshObject(name, scale * np.array(mesh.vertices), np.array(mesh.faces))


def exploration(name: str, most: int, scale: float = 1.0):
    """Atlas, planner and plans of an exploration with seed 1, of so many touches at most, with 17
    samples on each arm instead of 43, which takes less time."""
    obj, rng = body(name, scale), np.random.default_rng(1)
    atlas, planner = Atlas(scale * TOLERANCE), Planner(*obj.start(), PlannerOptions(step=0.035))
    steps = explore(atlas, planner, Probe(obj, scale * NOISE, rng), most)
    plans = [step.plan for step in steps]
    return atlas, planner, plans


@lru_cache
def explored(name: str):
    atlas, planner, plans = exploration(name, 60)
    atlas.finish()
    return atlas, planner, plans


@pytest.mark.parametrize("name", ["cylinder", pytest.param("box", marks=pytest.mark.slow)])
def test_a_lawful_body_is_known_from_few_touches_and_closed(name):
    """The cylinder took 16 touches, and the box 25. The points within the tolerance have a
    standard error of 0.002 at most."""
    atlas, planner, plans = explored(name)
    assert planner.stop.reason is StopReason.KNOWN
    assert len(plans) <= 45
    assert len(atlas.body.faces) == {"cylinder": 3, "box": 6}[name]
    points, _ = body(name).sample(4000, np.random.default_rng(2))
    found = atlas.blend(points)
    distance = np.abs(np.nan_to_num(found.distance, nan=np.inf))
    assert (distance <= TOLERANCE).mean() >= 0.99
    atlas.validate()
    # In the cubes by which touches are planned, a 32nd of the extent.
    surface = extract_surface(atlas, atlas.body.extent / 32)
    mesh = surface.to_trimesh()
    assert mesh.is_watertight and mesh.euler_number == 2
    # The volume is that of the body, to the tolerance times the area.
    truth = trimesh.Trimesh(body(name).vertices, body(name).faces)
    assert mesh.volume == pytest.approx(truth.volume, abs=TOLERANCE * truth.area)


def test_other_parts_are_searched_for_beside_a_lawful_body():
    """A planner without an answered touch."""
    atlas, _, _ = explored("cylinder")
    planner = Planner(*body("cylinder").start(), PlannerOptions(search=1))
    assert planner.ask(atlas).reason is Reason.SEARCH


def test_the_blend_of_a_lawful_body_is_that_of_its_faces():
    """Inside the tolerance it is sharp: half-way between rim and axis of the end, and beside it."""
    atlas, _, _ = explored("cylinder")
    points = np.array([[12.0, 3.0, 15.0], [0.0, 25.0, 2.0], [24.0, 0.0, 15.0]])
    outward = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    found = atlas.blend(points + 0.5 * outward)
    assert found.known.all()
    # The sampled chords lie within the circle by 2e-3; a face errs by less than a sample's noise.
    assert found.distance == pytest.approx(0.5, abs=NOISE)
    # An end of radius 25 whose heights are right to a noise at its rim leans by a noise / 25.
    assert (found.normal * outward).sum(axis=1) == pytest.approx(1.0, abs=1e-5)
    assert found.gaussian_curvature == pytest.approx(0.0, abs=1e-12)


def test_cad_and_people_read_the_faces_of_a_lawful_body(tmp_path):
    """A cylinder is three faces and two edges in a STEP file, and in the graph of faces."""
    pytest.importorskip("OCP.STEPControl", reason="needs the extra cad")
    atlas, _, _ = explored("cylinder")
    report = save_step(atlas, tmp_path / "a.step")
    assert (report.planes, report.cylinders, report.faces, report.solids) == (2, 1, 3, 1)
    text = (tmp_path / "a.step").read_text()
    counts = [text.count(f"= {name}(") for name in ("PLANE", "CYLINDRICAL_SURFACE", "CIRCLE")]
    assert counts == [2, 1, 2]
    graph = atlas.body.faces.graph()
    assert sorted(words.split(",")[0] for _, words in graph.nodes(data="words")) == [
        "cylinder",
        "plane",
        "plane",
    ]
    assert [kind for *_, kind in graph.edges(data="kind")] == ["sharp convex"] * 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_all_holes_of_a_drilled_plate_are_found(seed):
    """Six of a thirtieth of the extent, amid squares of seven radii. Without places that are
    verified five of them were found with seed 1, and the plate counted as known."""
    found = explore_body(lawful_object("drilled"), 100, seed)
    assert found.stop.reason is StopReason.KNOWN
    holes = [face for face in found.atlas.body.faces.faces if face.kind == "cylinder"]
    assert len(holes) == 6
    surface = extract_surface(found.atlas)
    mesh = surface.to_trimesh()
    assert mesh.is_watertight and mesh.euler_number == 2 - 2 * 6
