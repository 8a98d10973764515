"""Faults by name: each from evidence that is put together by hand or made by a faulty probe."""

from dataclasses import replace

import numpy as np
import pytest

from tests.explored import learned, spread_touches
from touchatlas.atlas import Atlas, doubts
from touchatlas.atlas.check.faults import bad_contacts, faults, moved_object, slipped_contacts
from touchatlas.atlas.samples.crossings import Crossings
from touchatlas.atlas.samples.evidence import ProbeEvidence, TouchEvidence
from touchatlas.planner import Planner, PlannerOptions, Reason, StopReason, explore
from touchatlas.sim import Probe, make_object

STD = 0.05
STEP = np.array([0.3, -0.2, 0.1])


def crossings_of_touches(count, step, rng, since=np.inf, each=4) -> Crossings:
    """Crossings of each touch with the one before, with normals all around, of an object that has
    moved by a step (3,) since a touch."""
    later = np.repeat(np.arange(1.0, count), each)
    normals = rng.normal(size=(len(later), 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    gaps = (normals @ step) * (later == since) + STD * rng.normal(size=len(later))
    return Crossings(later - 1.0, later, 10.0 * normals, normals, gaps, np.full(len(later), STD**2))


def atlas_of(crossings, count) -> Atlas:
    """An atlas that holds nothing but a sample, and evidence of crossings of so many touches."""
    atlas = Atlas(0.1, scale=0.1)
    up = np.eye(3)[2:]
    atlas.pool.add(up, up, up, False, STD)
    touches = tuple(TouchEvidence(k, 100.0) for k in range(count))
    atlas.evidence = replace(atlas.evidence, touches=touches, crossings=crossings)
    return atlas


def test_a_move_is_named_with_its_size_its_touch_and_its_places():
    """Eight crossings tell the step to twice the deviation of a gap in each direction."""
    found = crossings_of_touches(9, STEP, np.random.default_rng(0), since=6.0, each=8)
    fault = moved_object(atlas_of(found, 9))
    assert fault.name == "moved" and "after touch 6;" in fault.words
    assert fault.size == pytest.approx(np.linalg.norm(STEP), abs=3.0 * STD)
    assert fault.statistic > fault.expected and fault.chance < 1e-5
    assert 1 <= len(fault.places) <= 5
    assert np.allclose(np.linalg.norm(fault.places, axis=1), 10.0)


def test_still_objects_have_not_moved():
    """A thousand explorations of twenty touches would name one; thirty name none."""
    for seed in range(30):
        found = crossings_of_touches(20, np.zeros(3), np.random.default_rng(seed))
        assert moved_object(atlas_of(found, 20)) is None, seed


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
    found = crossings_of_touches(6, STEP, np.random.default_rng(0), since=3.0, each=8)
    atlas.evidence = atlas_of(found, 6).evidence
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
