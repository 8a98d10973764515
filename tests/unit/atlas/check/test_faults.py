"""Faults by name: each from evidence that is put together by hand or made by a faulty probe."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import learned, spread_touches
from touchatlas.atlas import Atlas, doubts
from touchatlas.atlas.check.faults import bad_contacts, faults, moved_object, slipped_contacts
from touchatlas.atlas.learn import compared
from touchatlas.atlas.samples.evidence import ProbeEvidence, TouchEvidence
from touchatlas.atlas.samples.shift import Shift
from touchatlas.patch.geometry.frame import any_tangent
from touchatlas.planner import Planner, PlannerOptions, Reason, StopReason, explore
from touchatlas.sim import Probe, make_object

STD = 0.05
STEP = np.array([0.3, -0.2, 0.1])


def shift_by(step, rng, std=STD, count=5) -> Shift:
    """What samples with normals all around say after a step (3,) of the object."""
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    distance = normals @ step + std * rng.normal(size=count)
    return Shift(
        normals.T @ normals / std**2,
        normals.T @ distance / std**2,
        float(distance @ distance) / std**2,
    )


def atlas_of(shifts) -> Atlas:
    """An atlas that holds nothing but evidence of shifts."""
    atlas = Atlas(0.1, scale=0.1)
    touches = tuple(TouchEvidence(k, 100.0, shift=one) for k, one in enumerate(shifts))
    atlas.evidence = replace(atlas.evidence, touches=touches)
    return atlas


def test_a_move_is_named_within_three_touches_with_its_size_and_the_touch():
    rng = np.random.default_rng(0)
    still = [shift_by(np.zeros(3), rng) for _ in range(6)]
    moved = [shift_by(STEP, rng) for _ in range(3)]
    assert moved_object(atlas_of(still)) is None
    fault = moved_object(atlas_of(still + moved))
    assert fault.name == "moved" and "after touch 6;" in fault.words
    assert fault.size == pytest.approx(np.linalg.norm(STEP), abs=3.0 * STD)
    assert fault.statistic > fault.expected and fault.chance < 1e-5


def test_what_no_curve_has_crossed_tells_no_move():
    """Samples farther than a step from all others may lie on a step that nothing has met: those of
    a second touch, two steps off and higher, tell nothing, and the same ones on the curve do."""
    atlas = learned(spread_touches(make_object("sphere"), 5), 0.1)
    line = atlas.pool.points[atlas.pool.contours == 0]
    up = atlas.pool.normals[atlas.pool.contours == 0]
    step = np.linalg.norm(np.diff(line, axis=0), axis=1).mean()
    noise = np.full(len(line), 0.02)
    assert compared(atlas, line + 0.3 * up, noise, up)[1].square > 0.0
    assert compared(atlas, line + 2.0 * step * up, noise, up)[1].square == 0.0


def test_what_faces_another_way_than_the_surface_tells_no_move():
    """Beyond an edge that no contour has crossed another face begins within a step of samples."""
    atlas = learned(spread_touches(make_object("sphere"), 5), 0.1)
    line = atlas.pool.points[atlas.pool.contours == 0]
    up = atlas.pool.normals[atlas.pool.contours == 0]
    across = np.cross(up, any_tangent(up[0]))
    noise = np.full(len(line), 0.02)
    assert compared(atlas, line + 0.3 * up, noise, across)[1].square == 0.0


def test_a_surface_that_leaves_its_own_samples_tells_no_move(monkeypatch):
    """As the wrong face of a slot does: samples are nearer to each other than to the surface."""
    atlas = learned(spread_touches(make_object("sphere"), 5), 0.1)
    line = atlas.pool.points[atlas.pool.contours == 0]
    up = atlas.pool.normals[atlas.pool.contours == 0]
    noise = np.full(len(line), 0.02)
    monkeypatch.setattr(type(atlas.body), "away", lambda body, points: np.full(len(points), 0.1))
    # The noise of the ball is a tenth of its tolerance: four deviations are less than 0.1.
    assert compared(atlas, line + 0.3 * up, noise, up)[1].square == 0.0
    assert compared(atlas, line + 0.09 * up, noise, up)[1].square > 0.0


def test_still_objects_have_not_moved():
    """A thousand explorations of twenty touches would name one; thirty name none."""
    for seed in range(30):
        rng = np.random.default_rng(seed)
        shifts = [shift_by(np.zeros(3), rng) for _ in range(20)]
        assert moved_object(atlas_of(shifts)) is None, seed


def test_bad_contacts_are_counted_and_shown():
    atlas = learned(spread_touches(make_object("sphere"), 3), 0.1)
    assert bad_contacts(atlas) is None
    atlas.bad_contacts = np.arange(30.0).reshape(10, 3)
    fault = bad_contacts(atlas)
    share = 10.0 / atlas.evidence.sum("samples")
    assert fault.size == pytest.approx(share) and f"{share:.2%}" in fault.words
    assert 1 <= len(fault.places) <= 5
    assert slipped_contacts(atlas) is None


def test_a_sound_probe_has_no_fault_and_a_noisy_one_is_named():
    """Spread touches of a ball: with three times the noise, the very fault and no other."""
    obj = make_object("sphere")
    assert not faults(learned(spread_touches(obj, 6), obj.tolerance))
    loud = [
        replace(
            touch, contours=tuple(replace(c, noise_std=c.noise_std / 3.0) for c in touch.contours)
        )
        for touch in spread_touches(obj, 6)
    ]
    atlas = learned(loud, obj.tolerance, scale=0.1)
    [fault] = faults(atlas)
    assert fault.name == "larger noise" and fault.size == pytest.approx(3.0, rel=0.2)
    assert fault.as_dict()["words"].startswith("The noise is 3") or fault.size < 2.95
    assert "larger noise" in [doubt.name for doubt in doubts(atlas)]
    # Samples count as what they are.
    assert atlas.pool.noise[-1] == pytest.approx(obj.noise_std, rel=0.2)


def test_a_move_ends_an_exploration_and_its_stop_says_so():
    obj = make_object("sphere")
    atlas, planner = Atlas(obj.tolerance, scale=0.1), Planner(*obj.start())
    probe = Probe(obj, obj.noise_std, np.random.default_rng(0))
    touch = next(iter(explore(atlas, planner, probe, 1))).touch
    rng = np.random.default_rng(0)
    moved = atlas_of([shift_by(np.zeros(3), rng)] * 3 + [shift_by(STEP, rng) for _ in range(3)])
    atlas.evidence = moved.evidence
    assert planner.ask(atlas) is None and planner.stop.reason is StopReason.MOVED
    assert "The object has moved by" in str(planner.stop) and touch.number == 0


def test_the_first_place_is_touched_again():
    """After two touches, and after two more with itself; the ball lies still."""
    obj = make_object("sphere")
    atlas = Atlas(obj.tolerance, scale=0.1)
    planner = Planner(*obj.start(), PlannerOptions(datum=2))
    probe = Probe(obj, obj.noise_std, np.random.default_rng(0))
    steps = list(explore(atlas, planner, probe, 5))
    again = [k for k, step in enumerate(steps) if step.plan.reason is Reason.DATUM]
    assert again == [2, 4]
    for k in again:
        assert steps[k].plan.reference_point == pytest.approx(steps[0].touch.contact)
    assert not faults(atlas)


def test_evidence_of_nothing_names_nothing():
    assert not faults(Atlas(0.1)) and ProbeEvidence().noise_factor == 1.0
