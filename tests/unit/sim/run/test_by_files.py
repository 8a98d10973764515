"""next and learn, one call each touch, explore as explore does: same touches, same atlas."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.command import assert_refused, ran, touchatlas
from touchatlas.sim import Journal, Probe, make_object
from touchatlas.sim.folder.plan_files import touch_as_dict
from touchatlas.sim.run.learning import pending_plans
from touchatlas.sim.run.work import random_streams


def explored(folder, name, noise, tolerance, budget):
    words = "--noise", noise, "--tolerance", tolerance, *budget
    ran("explore", name, *words, "--out", "explored", cwd=folder)
    return folder / "explored"


def answered(folder, name, noise, tolerance, most):
    """A machine that reads plans and writes answers. Its arms end where the surface is known, as
    those of the simulated probe do in explore: the files do not say where that is."""
    obj, run = make_object(name), folder / "by_files"
    probe, (start, outward) = Probe(obj, noise, random_streams(0)[0]), obj.start()
    write = {"start": start, "outward": outward}
    words = [f"--{key}={','.join(map(repr, np.array(v).tolist()))}" for key, v in write.items()]
    begin = *words, "--noise", noise, "--tolerance", tolerance
    for number in range(most):
        done = ran("next", run, "--json", *(begin if number == 0 else ()), cwd=folder)
        if not json.loads(done.stdout)["plans"]:
            break
        [plan] = pending_plans(run).values()
        (folder / "answer.json").write_text(json.dumps([touch_as_dict(probe(plan))]))
        done = ran("learn", run, "answer.json", "--no-draw", cwd=folder)
    return run


@pytest.mark.usefixtures("no_pictures", "few_judged")
@pytest.mark.parametrize(
    ("name", "noise", "tolerance", "most"),
    [
        ("sphere", 0.12, 0.6, 2),
        pytest.param("bottle", 0.02, 0.1, 100, marks=pytest.mark.slow),
        pytest.param("cube", 0.02, 0.1, 100, marks=pytest.mark.slow),
    ],
)
def test_next_and_learn_explore_as_explore_does(tmp_path, name, noise, tolerance, most):
    budget = ("--max-touches", most) if most < 100 else ()
    one = explored(tmp_path, name, noise, tolerance, budget)
    other = answered(tmp_path, name, noise, tolerance, most)
    touches = [Journal(run / "journal.sqlite").touches() for run in (one, other)]
    assert len(touches[0]) == len(touches[1])
    for first, second in zip(*touches, strict=True):
        assert first.status == second.status
        assert first.contact.tobytes() == second.contact.tobytes()
        for a, b in zip(first.contours, second.contours, strict=True):
            assert a.points.tobytes() == b.points.tobytes() and a.ends == b.ends
    ran("learn", other, cwd=tmp_path)
    assert (one / "atlas.npz").read_bytes() == (other / "atlas.npz").read_bytes()


def test_of_several_answers_those_before_a_refused_one_are_learned_and_it_is_told(tmp_path):
    """A first one that is too short teaches nothing, which is said; of two more the second has
    another tip, and its plan stays pending."""
    obj, run = make_object("sphere"), tmp_path / "run"
    probe = Probe(obj, 0.12, random_streams(0)[0])
    begin = "next", run, "--start=0,0,33", "--outward=0,0,1", "--noise=0.12", "--tolerance=0.6"
    ran(*begin, cwd=tmp_path)
    touch = probe(next(iter(pending_plans(run).values())))
    short = tuple(replace(c, points=c.points[:2]) for c in touch.contours)
    answer = tmp_path / "answer.json"
    for wrong, said in (
        ({"contours": short}, "the answer to plan 0 taught nothing: contours of 5 points or more"),
        ({}, ""),
    ):
        touch = probe(next(iter(pending_plans(run).values())))
        answer.write_text(json.dumps([touch_as_dict(replace(touch, **wrong))]))
        assert said in ran("learn", run, answer, "--no-draw", cwd=tmp_path).stderr
        ran("next", run, "--count", 2, cwd=tmp_path)
    first, second = map(probe, pending_plans(run).values())
    held = [touch_as_dict(first), touch_as_dict(replace(second, tip_radius=1.0))]
    answer.write_text(json.dumps(held))
    said = "plan 3 stays pending, answers to 2 are learned: leave them out"
    assert_refused(touchatlas("learn", run, answer, "--no-draw", cwd=tmp_path), 2, said)
    assert list(pending_plans(run)) == [3]
