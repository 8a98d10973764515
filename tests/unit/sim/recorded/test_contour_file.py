"""Files of contours: what is read, what is refused, and what is made of the curves."""

import numpy as np
import pytest

from tests.truths import BALL_RADIUS, ball_height, graph_contours
from touchatlas.patch import ContourEnd
from touchatlas.patch.fit.curve_noise import estimate_noise
from touchatlas.sim.recorded.arcs import near_arc
from touchatlas.sim.recorded.contour_file import read_curves
from touchatlas.sim.recorded.curves import Curve
from touchatlas.sim.recorded.recording import prepare
from touchatlas.sim.recorded.reference_point import meeting_point

LINES = [f"{c},{x},{k},{x * x}" for k, c in enumerate("abc") for x in range(6)]
HEADER = "curve,x,y,z"


@pytest.fixture
def file(tmp_path):
    def write(*lines, encoding="utf-8"):
        path = tmp_path / "c.csv"
        path.write_text("\n".join(lines) + "\n", encoding=encoding)
        return path

    return write


def curves_of(contours, planes=False):
    return [
        Curve(name, c.points, c.plane.normal if planes else None)
        for name, c in zip("abcdefgh", contours, strict=False)
    ]


def ball_curves(noise=0.02, count=25, reach=12.0, seed=0, **more):
    rng = np.random.default_rng(seed)
    return curves_of(graph_contours(ball_height, reach, count, noise, rng, **more))


def test_columns_in_any_order_with_extra_ones_and_a_byte_order_mark(file):
    lines = [",".join([*reversed(line.split(",")), "7"]) for line in LINES]
    curves, repeated, *_ = read_curves(file("Z , y,x,curve,time", *lines, "", encoding="utf-8-sig"))
    assert [curve.name for curve in curves] == ["a", "b", "c"] and not repeated
    assert curves[1].points.tolist() == [[x, 1.0, x * x] for x in range(6)]
    assert all(curve.normal is None for curve in curves)


def test_plane_normals_are_read_and_made_unit(file):
    lines = [f"{line},0,-2,0" for line in LINES] + [",0,0,1,,,"]
    curves, *_ = read_curves(file(HEADER + ",nx,ny,nz", *lines))
    assert curves[0].normal.tolist() == [0.0, -1.0, 0.0]
    assert curves[3].name == "" and curves[3].normal is None


def test_repeated_points_count_once_but_a_loop_keeps_its_end(file):
    curves, repeated, *_ = read_curves(file(HEADER, *LINES, LINES[3]))
    assert repeated and len(curves[0].points) == 6
    curves, repeated, *_ = read_curves(file(HEADER, *LINES[:6], LINES[0]))
    assert not repeated and len(curves[0].points) == 7


REFUSED = {
    "is empty": [""],
    "no points below its header": [HEADER],
    "no column z among curve, x, y": ["curve,x,y", "a,0,0"],
    "no column x, y, z among u, v, w": ["u;v;w", "1;0;x"],
    "x, y, z in different units (m, mm)": ["curve,x [mm],y [mm],z [m]", "a,1,2,3"],
    "y is '1.234,5'": ["curve;x;y;z", "a;1,5;1.234,5;3,5"],
    "has nx only": [HEADER + ",nx", "a,0,0,0,1"],
    "column x twice": [HEADER + ",x", "a,0,0,0,1"],
    "line 3 has 7 cells, but most lines 4": [HEADER, "a,1,2,3", "a,1,5,2,5,3,5"],
    "line 3 has 3 cells, but most lines 4; fill them in, or delete": [HEADER, "a,1,2,3", "b,1,2"],
    "different units (dm, mm)": ["curve,x,y,z", "a,mm,mm,dm", "a,1,2,3"],
    "different units (none, mm)": ["curve,x,y [mm],z [mm]", "a,1,2,3"],
    "no line holds a number": ["curve,x,y,z", "a,mm,mm,mm"],
    "line 2: y is 'one'": [HEADER, "a,1,one,3"],
    "has no points; c.csv was read so": [HEADER, "a,,2,3"],
    "has no points; c.csv was read so: cells are separated by semicolons": ["x;y;z", ";;1", ";;2"],
    "lines left out: 2 that hit calls failed": ["x,y,z,hit", "1,2,3,0", "1,2,4,0"],
    "line 2: nz is ''": [HEADER + ",nx,ny,nz", "a,1,2,3,1,0,"],
    "correct the quoting": [HEADER, 'a,"1"x,2,3'],
    "points that span": [HEADER, "a,1,2,3", "b,1,2,1e200"],
    "one point only": [HEADER, "a,1,2,3", "b,1,2,3"],
}


@pytest.mark.parametrize("words", REFUSED)
def test_a_bad_file_is_refused_in_one_sentence(file, words):
    with pytest.raises(ValueError) as refusal:
        read_curves(file(*REFUSED[words]))
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


def test_missing_and_binary_files_are_refused(tmp_path):
    with pytest.raises(ValueError, match="is no file"):
        read_curves(tmp_path)
    for data in (bytes(range(256)) * 9, b"\xff\xfe\x00\xd8"):
        (tmp_path / "binary").write_bytes(data)
        with pytest.raises(ValueError, match="is no text"):
            read_curves(tmp_path / "binary")


SAME = [tuple(line.split(",")) for line in LINES]
PARTED = [",".join(r[1:]) + "\n" * (r[1] == "5") for r in SAME]
SLOPPY = {
    "cells are separated by semicolons": ["curve;x;y;z", *(";".join(row) for row in SAME)],
    "cells are separated by tabs": ["curve\tx\ty\tz", *("\t".join(row) for row in SAME)],
    "cells are separated by spaces": ["curve x y z", *("  ".join(row) for row in SAME)],
    "cells are separated by bars": ["curve|x|y|z", *("|".join(row) for row in SAME)],
    "with a comma": ["curve;x;y;z", *(f"{c};{x},0;{y},00;{z},0" for c, x, y, z in SAME)],
    "spaces": ["curve x y z", *(f"{c} {x},0 {y},00 {z},0" for c, x, y, z in SAME)],
    "18 points of 3 curves, in mm": ["curve,x [mm],y [mm],z [mm]", *LINES],
    "18 points of 3 curves, in cm": ["curve,x_cm,y_cm,z_cm", *LINES],
    "18 points of 3 curves, in dm": ["curve,x,y,z", ",dm,[dm],dm", *LINES],
    "x, y, z are px, py, pz; curves by column contour_id": ["contour_id,px,py,pz", *LINES],
    "of words or comment skipped: 1 (4)": ["# hand", HEADER, LINES[0], "# now", *LINES[1:]],
    "curves by column curve": ["# curve x y z", *(" ".join(row) for row in SAME)],
    "x, y, z are column 2, column 3, column 4": LINES,
    "column 1, column 2, column 3; curves by column 4": [",".join([*r[1:], r[0]]) for r in SAME],
    "x, y, z are x, y, z; curves by empty lines": ["x,y,z", *PARTED],
    "column 2, column 3; curves by empty lines": PARTED,
}


@pytest.mark.parametrize("words", SLOPPY)
def test_the_files_that_people_have_give_the_same_curves_and_say_how_they_were_read(file, words):
    expected = read_curves(file(HEADER, *LINES)).curves
    found = read_curves(file(*SLOPPY[words]))
    curves = found.curves
    assert words in found.how and not found.repeated
    assert len(curves) == 3
    for curve, true in zip(curves, expected, strict=True):
        assert (curve.points == true.points).all()


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16"])
def test_other_encodings_are_read_and_said(file, encoding):
    lines = ["curve,x [µm],y [µm],z [µm]", *(f"Bö{line}" for line in LINES)]
    curves, _, assumed, *_ = read_curves(file(*lines, encoding=encoding))
    assert [curve.name for curve in curves] == ["Böa", "Böb", "Böc"]
    assert "not UTF-8" in assumed[0] and assumed[-1].endswith("in um")


def test_meeting_point_of_a_ball_is_on_the_curves():
    assert meeting_point([c.points for c in ball_curves(0.0)]) == pytest.approx(0.0, abs=1e-9)


def test_height_of_the_meeting_point_comes_from_the_samples():
    """All planes hold the z axis: only the curves tell how high they cross."""
    curves = [Curve(c.name, c.points + [0.0, 0.0, 5.0], c.normal) for c in ball_curves()]
    # Three nearest points, each off by 0.02.
    assert prepare(curves).point == pytest.approx([0.0, 0.0, 5.0], abs=4 * 0.02)


def test_estimated_noise_is_the_noise():
    for noise in (0.002, 0.02):
        contours = graph_contours(ball_height, 12.0, 101, noise, np.random.default_rng(1))
        points, normals = zip(*((c.points, c.plane.normal) for c in contours), strict=True)
        assert estimate_noise(points, normals) == pytest.approx(noise, rel=0.15)
        spoilt = tuple(p + 50 * noise * (np.arange(101) == 30)[:, None] for p in points)
        assert estimate_noise(spoilt, normals) == pytest.approx(noise, rel=0.2)


def test_points_closer_together_than_the_noise_estimate_it_too():
    contours = graph_contours(ball_height, 12.0, 10_001, 0.05, np.random.default_rng(1))
    points, normals = zip(*((c.points, c.plane.normal) for c in contours), strict=True)
    assert estimate_noise(points, normals) == pytest.approx(0.05, rel=0.02)


def test_a_contour_that_was_written_twice_counts_once(file):
    again = [line.replace("b", "again") for line in LINES if line.startswith("b")]
    found = read_curves(file(HEADER, *LINES, *reversed(again)))
    assert [curve.name for curve in found.curves] == ["a", "b", "c"]
    assert found.warnings == ("curve 'again' repeats 6 points of curve 'b'; each was counted once",)


def test_columns_that_are_not_used_are_said(file):
    lines = [f"{k},{line},ok" for k, line in enumerate(LINES)]
    found = read_curves(file("id,Kurve,x,y,z,remark", *lines))
    assert [curve.name for curve in found.curves] == ["a", "b", "c"]
    assert "curves by column Kurve" in found.assumed
    assert "ignored: id, remark" in found.assumed


def test_an_unknown_column_of_curves_is_said_where_empty_lines_part_them(file):
    lines = [line for k in range(3) for line in (*LINES[6 * k : 6 * k + 6], "")]
    found = read_curves(file("Strecke,x,y,z", *lines))
    assert len(found.curves) == 3
    assert "curves by empty lines" in found.assumed and "ignored: Strecke" in found.assumed


def test_empty_lines_that_part_a_curve_are_warned_of(file):
    parted = read_curves(file(HEADER, *LINES[:3], "", *LINES[3:]))
    assert len(parted.curves) == 3 and "empty lines make 2 blocks" in parted.warnings[0]
    agreed = read_curves(file(HEADER, *LINES[:6], "", *LINES[6:12], "", *LINES[12:]))
    assert len(agreed.curves) == 3 and not agreed.warnings


def test_the_first_line_of_excel_is_read(file):
    for separator in ";", ",", "\t":
        lines = [line.replace(",", separator) for line in (HEADER, *LINES)]
        assert len(read_curves(file(f"sep={separator}", *lines)).curves) == 3


def test_z_in_another_unit_is_said_in_one_sentence():
    stretched = [Curve(c.name, c.points * [1, 1, 1000], None) for c in ball_curves()]
    with pytest.raises(ValueError, match="see whether z has another unit: it spans .* as x and y"):
        prepare(stretched)


def test_the_curve_without_which_the_others_meet_is_named_and_none_where_none_is():
    curves = ball_curves()
    for k in range(3):
        apart = list(curves)
        apart[k] = Curve("far", curves[k].points + [20.0, 10.0, 60.0], None)
        with pytest.raises(ValueError, match="without curve 'far' the others meet"):
            prepare(apart)
    parted = [
        Curve(c.name, c.points + 60.0 * axis, None)
        for c, axis in zip(curves, np.eye(3), strict=True)
    ]
    with pytest.raises(ValueError, match="leaving out no single curve mends that"):
        prepare(parted)


def test_a_single_bad_contact_does_not_cut_a_curve():
    points = ball_curves()[0].points.copy()
    points[7] += [0.0, 0.0, 8.0]
    assert len(near_arc(points, np.zeros(3))[0]) == len(points)


def test_a_curve_that_misses_the_point_is_refused():
    curves = ball_curves()
    away = Curve("far", curves[2].points + [0.0, 60.0, 0.0], None)
    with pytest.raises(ValueError, match="one passes .* away from .* without curve 'far'"):
        prepare([*curves[:2], away])


def test_fitted_planes_are_the_sampling_planes():
    rng = np.random.default_rng(2)
    contours = graph_contours(ball_height, 12.0, 41, 0.0, rng, tilt=0.3)
    for found, true in zip(prepare(curves_of(contours)).contours, contours, strict=True):
        assert abs(found.plane.normal @ true.plane.normal) == pytest.approx(1.0, abs=1e-9)


def test_a_straight_curve_takes_the_plane_of_the_surface_normal():
    contours = graph_contours(lambda x, y: -0.01 * y * y, 10.0, 21, 0.0, np.random.default_rng(3))
    straight = prepare(curves_of(contours)).contours[0]
    assert abs(straight.plane.normal @ [0.0, 1.0, 0.0]) == pytest.approx(1.0, abs=1e-6)


def test_great_circles_are_cut_where_they_turn_by_45_degrees():
    angle = np.linspace(0.0, 2.0 * np.pi, 181)[:, None] + 1.0
    curves = []
    for name, a in zip("abc", np.pi / 3 * np.arange(3), strict=True):
        across = np.array([np.cos(a), np.sin(a), 0.0])
        circle = BALL_RADIUS * (np.sin(angle) * across + np.cos(angle) * [0.0, 0.0, 1.0])
        curves.append(Curve(name, np.append(circle[:-1], circle[:1], axis=0), None))
    top = np.array([0.0, 0.0, BALL_RADIUS])
    found = prepare(curves, 0.0, top)
    assert found.flags == ("curves cut",)
    for contour in found.contours:
        turn = np.arccos(contour.points[:, 2] / BALL_RADIUS)
        assert turn[[0, -1]] == pytest.approx(np.pi / 4, abs=np.deg2rad(2.1))
        assert contour.ends == (ContourEnd.TURNED_AWAY,) * 2


def test_a_curve_that_starts_at_the_point_is_flagged_and_does_not_end_the_patch():
    points = ball_curves(count=41)[0].points[20:]
    arc, ends = near_arc(points, np.zeros(3))
    assert len(arc) == 21 and ends == (ContourEnd.UNREACHABLE, ContourEnd.LENGTH_REACHED)
    curves = [Curve("h", points, None), *ball_curves()[1:], *ball_curves(angles=[0.5])]
    assert "one-sided curves" in prepare(curves).flags


def test_curves_that_miss_each_other_are_flagged():
    curves = ball_curves()
    assert prepare(curves, 0.02).flags == ()
    apart = [Curve(c.name, c.points + [0.0, 0.0, k], None) for k, c in enumerate(curves)]
    assert "curves do not meet" in prepare(apart, 0.02).flags


def test_a_curve_off_its_plane_is_flagged():
    first, *others = ball_curves()
    s = np.linspace(-1.0, 1.0, len(first.points))
    bent = first.points + np.outer(s**3, [0.0, 2.0, 0.0])
    curves = [Curve("a", bent, np.array([0.0, 1.0, 0.0])), *others]
    assert "curves not planar" in prepare(curves, 0.02).flags


def test_short_and_nameless_curves_are_scattered_contacts_near_the_point():
    contacts = np.array([[3.0, 1.0, -0.15], [100.0, 0.0, 0.0]])
    short = ball_curves(count=3, reach=9.0)[0].points
    curves = [*ball_curves(), Curve("", contacts, None), Curve("s", short, None)]
    found = prepare(curves)
    assert found.names == ("a", "b", "c")
    assert found.scattered == pytest.approx(np.concatenate([contacts[:1], short]))


@pytest.mark.parametrize(
    ("curves", "noise", "point", "words"),
    [
        (ball_curves()[:2], None, None, "only 2 curves have 5 or more distinct points (a: 25, b"),
        ([Curve("", np.eye(3), None)], None, None, "no curve has 5 or more"),
        (ball_curves(angles=[0.0, 0.01, 0.02]), None, None, "nearly one direction"),
        (ball_curves(), None, [90.0, 0.0, 0.0], "away from all curves"),
        (ball_curves(), None, [1e300, 0.0, 0.0], "1e+300 away from all curves"),
        (ball_curves(), -1.0, None, "noise is -1.0"),
        (ball_curves(), 1e300, None, "but the curves are only"),
        (ball_curves(), np.nan, None, "noise is nan"),
    ],
)
def test_curves_that_cannot_be_fitted_are_refused(curves, noise, point, words):
    with pytest.raises(ValueError) as refusal:
        prepare(curves, noise, point)
    assert words in str(refusal.value)
