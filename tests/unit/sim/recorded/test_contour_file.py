"""Files of contours: what is read, and what is refused."""

import pytest

from touchatlas.sim.recorded.contour_file import read_curves

LINES = [f"{c},{x},{k},{x * x}" for k, c in enumerate("abc") for x in range(6)]
HEADER = "curve,x,y,z"


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
