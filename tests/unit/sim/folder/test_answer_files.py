"""Answers to plans as tables and JSON, as machines and spreadsheets write them, and mistakes."""

import json

import numpy as np
import pytest

from touchatlas.atlas import TouchStatus
from touchatlas.patch import ContourEnd, SamplingPlane
from touchatlas.planner import ProbePlan, Reason
from touchatlas.sim.folder.answer_files import is_answer, read_answers
from touchatlas.sim.folder.plan_files import plans_csv, plans_json, touch_as_dict

UP, ORIGIN = np.array([0.0, 0.0, 1.0]), np.zeros(3)
PLANES = tuple(SamplingPlane(ORIGIN, [np.sin(a), np.cos(a), 0.0]) for a in (0.0, 1.0, 2.0))
PLANS = {
    number: ProbePlan(number, ORIGIN, UP, PLANES, 10.0, 1.0, 0.8, Reason.START) for number in (2, 3)
}
HEAD = "plan,plane,x,y,z,event"
TABLE = f"{HEAD}\n2,,0.5,0,0.25,contact\n2,0,-1.5,0,0,edge\n2,0,0.5,0,0.25,\n2,0,2.5,0,0,\n"
MISS = f"{TABLE}3,,,,,no contact\n"


def read(folder, text, name="answer.csv", encoding="utf-8"):
    (folder / name).write_text(text, encoding=encoding)
    assert is_answer(folder / name)
    return read_answers(folder / name, PLANS, 0.01)


def european(text, separator):
    """As a spreadsheet writes it where decimals have commas."""
    return text.replace(",", separator).replace(".", ",")


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        (MISS, "utf-8"),
        (european(MISS, ";"), "utf-8"),
        (european(MISS, ";").replace("\n", ";;\n") + ";;;;;;;\n\n", "utf-8-sig"),
        (european(MISS, "\t"), "utf-16"),
        ("sep=;\n" + european(MISS, ";"), "cp1252"),
        (MISS.replace("\n2,", "\n2.0,").replace("-1.5", "\N{MINUS SIGN}1.5"), "utf-8"),
    ],
    ids=["commas", "semicolons", "empty cells", "tabs", "named separator", "numbers"],
)
def test_a_table_is_read_however_a_spreadsheet_writes_it(tmp_path, text, encoding):
    touch, miss = read(tmp_path, text, encoding=encoding)
    assert touch.contact.tolist() == [0.5, 0.0, 0.25]
    [contour] = touch.contours
    assert contour.points[:, 0].tolist() == [-1.5, 0.5, 2.5]
    assert contour.ends == (ContourEnd.EDGE, ContourEnd.LENGTH_REACHED)
    assert miss.number == 3 and miss.status is TouchStatus.NO_CONTACT


def test_an_arm_that_ends_where_the_probe_cannot_go_keeps_its_last_point(tmp_path):
    [touch] = read(tmp_path, TABLE.replace("2.5,0,0,", "2.5,0,0,unreachable"))
    assert touch.contours[0].points[-1].tolist() == [2.5, 0.0, 0.0]
    assert touch.contours[0].ends[1] is ContourEnd.UNREACHABLE


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("2,,0,0,0,contact", "plan 2 has a contact, but no points"),
        ("2,,,,,no contct", "line 2: the event 'no contct' is none of contact, no contact,"),
        ("2,0,0,0,0,03,", "'03' is none of.*semicolons where decimals have commas"),
        ("2,0,0,5,0,5,0,5", "has 8 cells, but the first line names 6; write decimals"),
        ("2,0,0,0,0,\n\n2,0,x,0,0,", "line 4: x is 'x'; a finite number is needed"),
        ("2,0,0,0,0,\n2,,,,,no contact", "event 'no contact', and points as well"),
        ("2,7,0,0,0,", "plan 2 has the planes 0 to 2, not 7"),
        ("2,1,0,0,0,\n2,0,0,3,0,\n2,0,1,3,0,", "plane 0: half of the contour points"),
        ("2.5,0,0,0,0,", "plan is '2.5'; a whole number is needed"),
        ("7,,,,,no contact", "plan 7 is not pending"),
        ("", "holds no answers"),
    ],
)
def test_mistakes_in_a_table_are_named(tmp_path, rows, said):
    with pytest.raises(ValueError, match=rf"answer\.csv.*{said}"):
        read(tmp_path, f"{HEAD}\n{rows}\n")


CONTOUR = {"points": [[0, 0, -1], [0, 0, 0], [0, 0, 1]]}
OFF = {"points": [[0, 3, -1], [0, 3, 0], [0, 3, 1]]}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"plan": "abc"}, "plan is 'abc'; a whole number is needed"),
        ({"plan": None}, "plan is None; a whole number is needed"),
        ({"contact": [0, 0]}, r"contact is \[0, 0\]; three finite numbers"),
        ({"status": "hit"}, "status is 'hit'; one of touched"),
        ({"tip_radius": "wide"}, "tip_radius is 'wide'; a finite number is needed"),
        ({"way": [[0, 0, 1]]}, r"way is \[\[0, 0, 1\]\]; two points"),
        ({"contours": 3}, "contours is 3; a list is needed"),
        ({"contours": []}, "no contours"),
        ({"contours": [[0, 0, 0]]}, r"contours\[0\] is \[0, 0, 0\]; an object with points"),
        ({"contours": [{}]}, r"contours\[0\] has no points"),
        ({"contours": [CONTOUR | {"number": 7}]}, r"contours\[0\]\.number is 7, but plan 2 has"),
        ({"contours": [CONTOUR] * 4}, r"contours\[3\]\.number is 3, but plan 2 has the planes 0"),
        ({"contours": [CONTOUR, OFF]}, r"contours\[1\]: half of the contour points"),
        ({"contours": [CONTOUR | {"ends": ["edge"]}]}, r"ends is \['edge'\]; two words of"),
        ({"contours": [CONTOUR | {"plane": {"point": [0, 0, 0]}}]}, r"\.plane has no normal"),
        ({"contours": [{"points": [[0, 0, 1], [1, 2]]}]}, r"points is .*; a list of points"),
        ({"contours": [{"points": []}]}, r"contours\[0\]\.points is \[\]; a list of points"),
    ],
)
def test_mistakes_in_json_are_named_by_file_touch_and_field(tmp_path, changed, said):
    with pytest.raises(ValueError, match=rf"answer\.json, touch 1: .*{said}"):
        read(tmp_path, json.dumps([{"plan": 2, "contours": [CONTOUR]} | changed]), "answer.json")


def test_json_of_a_touch_is_read_as_it_was(tmp_path):
    [touch] = read(tmp_path, TABLE)
    text = json.dumps(touch_as_dict(touch))
    [again] = read(tmp_path, text, "answer.json", "utf-8-sig")
    assert touch_as_dict(again) == touch_as_dict(touch)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("plans.csv", plans_csv(list(PLANS.values())).decode(), "holds plans, and no answers"),
        ("plans.json", plans_json(list(PLANS.values()), {"tolerance": 1.0}).decode(), "holds pl"),
        ("a.json", '{"plan": 2', "a.json is no JSON .*give a list of touches"),
        ("a.json", "[]", "holds no answers"),
    ],
)
def test_files_without_answers_are_told(tmp_path, name, text, said):
    with pytest.raises(ValueError, match=said):
        read(tmp_path, text, name)
