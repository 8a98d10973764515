"""One recording, written as measuring machines, robots, controls and cameras write it.

docs/files.md says where each form is from.
"""

import time

import numpy as np
import pytest

from touchatlas.sim.recorded.contour_file import read_curves
from touchatlas.sim.recorded.curves import ReadOptions
from touchatlas.sim.recorded.fit_file import fit_file
from touchatlas.sim.recorded.scans import read_scans

# A cap with curvatures -1/40 and -1/25 along x and y, cut three times through its top.
S = np.linspace(-8.0, 8.0, 25)
CURVES = []
for angle in np.pi / 3 * np.arange(3):
    x, y = S * np.cos(angle), S * np.sin(angle)
    z = -0.5 * (x * x / 40 + y * y / 25)
    CURVES.append(np.round(np.stack([x + 12, y - 3.5, z + 4], axis=1), 4))
SLOPES = [(p - [12, -3.5, 4]) * [1 / 40, 1 / 25, 0] + [0, 0, 1] for p in CURVES]
NORMALS = [n / np.linalg.norm(n, axis=1, keepdims=True) for n in SLOPES]


def rows(form, gap=()):
    """Lines of all points by a format of curve, point, time, coordinates and normal."""
    lines = []
    for k, (points, normals) in enumerate(zip(CURVES, NORMALS, strict=True)):
        for i, (point, normal) in enumerate(zip(points, normals, strict=True)):
            cells = dict(zip(("px", "py", "pz", "nx", "ny", "nz"), [*point, *normal], strict=True))
            lines.append(form.format(k=k, i=i, j=25 * k + i, t=30 * k + 0.05 * i, **cells))
        lines += list(gap) if k < 2 else []
    return lines


MM, POSE = "{px:.4f},{py:.4f},{pz:.4f}", "{px:.4f} {py:.4f} {pz:.4f}"
IJK = MM + ",{nx:.5f},{ny:.5f},{nz:.5f}"
COMMA = [line.replace(".", ",") for line in rows("E{k};{i};" + IJK.replace(",", ";"))]

# What is in the file, a unit that it says, and words of how it was read.
KINDS = {
    "bare": (rows(POSE), "", "by jumps"),
    "blank lines": (rows(MM, [""]), "", "by empty lines"),
    "double spaced": ([w for line in rows(MM) for w in (line, "")], "", "by jumps"),
    "NaN": (["x,y,z", *rows(MM, ["NaN,NaN,NaN"])], "", "by lines of NaN"),
    "comments": (rows(POSE, ["# next"]), "", "by lines of words"),
    "trailing commas": (rows(MM + ","), "", "by jumps"),
    "brackets": (rows("({px:.4f}, {py:.4f}, {pz:.4f})", [""]), "", "by empty lines"),
    "minus sign": ([line.replace("-", "\u2212") for line in rows(MM)], "", "by jumps"),
    "metadata": (
        ["Device,LJ", "Unit,mm", "", "profile,X,Y,Z", *rows("{k}," + MM)],
        "mm",
        "profile",
    ),
    "counter": (rows("{j} " + POSE), "", "ignored: column 1"),
    "time": (rows("{t:.2f}," + MM), "", "time is column 1"),
    "point names": (["Name;X;Y;Z", *rows("S{k}.{i};" + MM.replace(",", ";"))], "", "without"),
    "English": (["Feature,X Actual,Y Actual,Z Actual", *rows("F{k}," + MM)], "", "Feature"),
    "German": (["Element;Pkt;X-Wert;Y-Wert;Z-Wert;Nx;Ny;Nz", *COMMA], "", "column Element"),
    "French": (
        [
            "Courbe;Coordonnée X (mm);Coordonnée Y (mm);Coordonnée Z (mm)",
            *rows("{k};" + MM.replace(",", ";")),
        ],
        "mm",
        "Courbe",
    ),
    "Italian": (
        [
            "Curva;X misurato;Y misurato;Z misurato;X teorico;Y teorico;Z teorico",
            *rows("{k};" + MM.replace(",", ";") + ";1;2;{i}"),
        ],
        "",
        "X misurato",
    ),
    "Spanish": (
        ["Perfil;Coordenada X;Coordenada Y;Coordenada Z", *rows("P{k};" + MM.replace(",", ";"))],
        "",
        "Perfil",
    ),
    "Japanese": (["曲線,X座標,Y座標,Z座標", *rows("{k}," + MM)], "", "曲線"),
    "nominal and actual": (
        ["S;Xnom;Ynom;Znom;Xact;Yact;Zact", *rows("S{k};1;2;{i};" + MM.replace(",", ";"))],
        "",
        "Xact",
    ),
    "target": (
        ["target_x,target_y,target_z,x,y,z,line", *rows("1,2,{i}," + MM + ",{k}")],
        "",
        "line",
    ),
    "DMIS": (
        [
            "UNITS/MM,ANGDEC",
            "MEAS/GCURVE,F(A),25",
            *rows("PTMEAS/CART," + IJK, ["ENDMES", "MEAS/GCURVE,F(B),25"]),
        ],
        "mm",
        "words",
    ),
    "PC-DMIS": (
        [
            w
            for line in rows(MM + ">,<{nx:.5f},{ny:.5f},{nz:.5f}")
            for w in ("THEO/<1,2,3>,<0,0,1>", f"ACTL/<{line}>")
        ],
        "",
        "ACTL/",
    ),
    "grbl": ([w for line in rows(MM) for w in ("G38.2 Z-9", f"[PRB:{line}:1]", "ok")], "", "PRB"),
    "PROBEOPEN": (rows(POSE + " 0.0" * 6), "", "by jumps"),
    "G-code": (["G21", *rows("G1 X{px:.4f} Y{py:.4f} Z{pz:.4f}", ["G0 Z90"])], "mm", "G-code"),
    "rostopic": (
        [
            "%time,field.pose.position.x,field.pose.position.y,field.pose.position.z,"
            "field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,"
            "field.pose.orientation.w",
            *rows("{t:.2f}," + MM + ",0,0,0,1"),
        ],
        "m",
        "position.x",
    ),
    "ros2 csv": (rows("17000,{i},base," + MM + ",0.0,0.0,0.0,1.0"), "m", "column 4, column 5"),
    "ros2 echo": (
        [
            w
            for line in rows(POSE)
            for w in (
                "pose:",
                "  position:",
                *(f"    {a}: {c}" for a, c in zip("xyz", line.split(), strict=True)),
                "  orientation:",
                "    x: 0.0",
                "    y: 0.0",
                "    z: 0.0",
                "    w: 1.0",
                "---",
            )
        ],
        "",
        "x:, y:, z:",
    ),
    "JSON lines": (
        rows('{{"t": {t:.2f}, "x": {px:.4f}, "y": {py:.4f}, "z": {pz:.4f}}}'),
        "",
        "x, y, z",
    ),
    "TUM": (["# timestamp tx ty tz qx qy qz qw", *rows("{t:.2f} " + POSE + " 0 0 0 1")], "m", "tx"),
    "EuRoC": (
        [
            "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
            "q_RS_y [], q_RS_z []",
            *rows("{t:.2f}," + MM + ",1,0,0,0"),
        ],
        "m",
        "p_RS_R_x",
    ),
    "KITTI": (rows("1 0 0 {px:.4f} 0 1 0 {py:.4f} 0 0 1 {pz:.4f}"), "m", "column 4, column 8"),
    "RTDE": (
        [
            "timestamp "
            + " ".join(f"actual_q_{i}" for i in range(6))
            + " "
            + " ".join(f"actual_TCP_pose_{i}" for i in range(6)),
            *rows("{t:.2f} 1 2 3 4 5 6 " + POSE + " 0 3.1 0"),
        ],
        "m",
        "actual_TCP_pose_0",
    ),
    "libfranka": (
        [
            "time, " + ", ".join(f"state.O_T_EE[{i}]" for i in range(16)),
            *rows("{t:.2f},1,0,0,0,0,1,0,0,0,0,1,0," + MM + ",1"),
        ],
        "m",
        "O_T_EE[12]",
    ),
    "Motive": (
        [
            "Format Version,1.23,Length Units,Meters",
            ",,Tip,Tip,Tip",
            ",,Position,Position,Position",
            "Frame,Time (Seconds),X,Y,Z",
            *rows("{j},{t:.2f}," + MM),
        ],
        "m",
        "X, Y, Z",
    ),
    "Qualisys": (
        [
            "NO_OF_FRAMES\t75",
            "MARKER_NAMES\tTip",
            "Frame\tTime\tTip X\tTip Y\tTip Z",
            *rows("{j}\t{t:.2f}\t" + MM.replace(",", "\t")),
        ],
        "",
        "Tip X",
    ),
    "tracker": (
        [
            "Frame,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error",
            *rows("{j},OK,1,0,0,0," + MM + ",0.2"),
            "99,MISSING,0,0,0,0,0,0,0,0",
        ],
        "",
        "State calls failed",
    ),
    "PCD": (
        [
            "# .PCD v.7",
            "VERSION .7",
            "FIELDS x y z normal_x normal_y normal_z",
            "SIZE 4 4 4 4 4 4",
            "TYPE F F F F F F",
            "COUNT 1 1 1 1 1 1",
            "DATA ascii",
            *rows(IJK.replace(",", " ")),
        ],
        "",
        "normals of the surface",
    ),
    "PTS": (["75", *rows(POSE + " 12 200 201 202")], "", "column 1, column 2"),
    "CloudCompare": (["//X,Y,Z,Original_cloud_index", *rows(MM + ",{k:.6f}")], "", "cloud_index"),
    "OBJ": (
        rows("v " + POSE)
        + [f"l {25 * k + i + 1} {25 * k + i + 2}" for k in range(3) for i in range(24)],
        "",
        "ending .obj",
    ),
    "Heidenhain": (
        ["BEGIN PGM 1 MM", *rows("{j} L X{px:+.4f} Y{py:+.4f} Z{pz:+.4f} R0 F500")],
        "mm",
        "X, Y, Z",
    ),
    "KUKA": (rows("{{X {px:.4f},Y {py:.4f},Z {pz:.4f},A 0,B 0,C 180}}"), "", "after x, y, z"),
    "Fanuc": (
        rows("P[{j}]{{ X = {px:.4f} mm, Y = {py:.4f} mm, Z = {pz:.4f} mm }};"),
        "mm",
        "after x",
    ),
    "ABB": (rows("[[{px:.4f},{py:.4f},{pz:.4f}],[1,0,0,0]]"), "m", "column 1, column 2, column 3"),
    "JSON list": ([f"[{','.join(rows('[{px:.4f},{py:.4f},{pz:.4f}]'))}]"], "", "by jumps"),
    "XML": (["<p>", *rows('<p x="{px:.4f}" y="{py:.4f}" z="{pz:.4f}"/>'), "</p>"], "", "after x"),
    "units in cells": (["x,y,z", *rows("{px:.4f} mm,{py:.4f} mm,{pz:.4f} mm")], "mm", "after each"),
    "Fortran": (
        [line.replace("e", "D") for line in rows("{px:.9e} {py:.9e} {pz:.9e}")],
        "",
        "jumps",
    ),
    "PTX": (["25", "3", *["1 0 0"] * 4, *["1 0 0 0"] * 4, *rows(POSE + " 0.5")], "", "column 4"),
    "nines": (["x,y,z", *rows(MM, ["-9999,-9999,-9999"])], "", "left out: 2 without coordinates"),
    "status": (
        ["Punkt;X;Y;Z;Status", *rows("{j};" + MM.replace(",", ";") + ";OK"), "99;0;0;0;Fehler"],
        "",
        "Status calls failed",
    ),
    "Fanuc program": (
        [
            "/PROG  A",
            "/MN",
            *rows("{j}: L P[{j}] 60cm/min CNT100 ;"),
            "/POS",
            *(
                w
                for line in rows("X = {px:.4f} mm, Y = {py:.4f} mm, Z = {pz:.4f} mm,")
                for w in (
                    "P[1] {",
                    "UF : 6, UT : 5,",
                    line,
                    "W = 0.0 deg, P = 0.0 deg, R = 0.0 deg",
                )
            ),
        ],
        "mm",
        "after x, y, z",
    ),
    "RAPID program": (
        [
            "MODULE A",
            *rows(
                "CONST robtarget p{j}:=[[{px:.4f},{py:.4f},{pz:.4f}],[1,0,0,0],[-1,0,-1,0],"
                "[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];"
            ),
            *rows("MoveL p{j},v100,z1,tool0;"),
        ],
        "mm",
        "robtarget",
    ),
    "KUKA program": (
        [
            "DEF A ( )",
            *rows(
                "LIN {{X {px:.4f},Y {py:.4f},Z {pz:.4f},A 0.0,B 90.0,C 0.0,E1 0}} C_DIS",
                ["PTP {A1 0.0, A2 -90.0, A3 90.0}"],
            ),
        ],
        "",
        "by lines of words",
    ),
    "APT": (
        ["PARTNO/A", "UNITS/MM", *rows("GOTO/ " + IJK.replace(",", ", "), ["RAPID"])],
        "mm",
        "normals of the surface",
    ),
    "Klipper": (
        [
            w
            for line in rows("// probe at {px:.4f},{py:.4f} is z={pz:.4f}")
            for w in ("21:09:48", line)
        ],
        "",
        "probe at",
    ),
    "Marlin": (
        [
            w
            for line in rows("X:{px:.4f} Y:{py:.4f} Z:{pz:.4f} E:0.0 Count 0 2743 1830")
            for w in (line, "ok")
        ],
        "",
        "after x, y, z",
    ),
    "SmartElectrode": (
        rows("P{j}, X={px:.4f}, Y={py:.4f}, Z={pz:.4f}, I={nx:.5f}, J={ny:.5f}, K={nz:.5f}"),
        "",
        "normals of the surface",
    ),
    "SpatialAnalyzer": (
        ["// SA 2026", *rows("A Scan{k} p{i} " + POSE)],
        "",
        "curves by column 2",
    ),
    "tcp in mm": (
        [
            "elapsed_sec,tcp_x_mm,tcp_y_mm,tcp_z_mm,tcp_ox,tcp_oy,tcp_oz",
            *rows("{t:.3f}," + MM + ",0,0,1"),
        ],
        "mm",
        "tcp_x_mm",
    ),
    "JSON objects": (
        [
            "["
            + ",".join(rows('{{"x":{px:.4f},"y":{py:.4f},"z":{pz:.4f},"roll":-2.8,"yaw":0.1}}'))
            + "]"
        ],
        "",
        "after x, y, z",
    ),
    "frames": (
        [
            w
            for k in range(3)
            for w in (f"# frame {k}", "x,y,z", *rows(MM)[25 * k : 25 * k + 25], "")
        ],
        "",
        "by empty lines",
    ),
    "spacecraft": (
        [
            "frame,epoch,x,y,z,vx,vy,vz",
            *rows("J2000,2026-11-28T00:00:{t:06.3f} UTC," + MM + ",1,2,3"),
        ],
        "",
        "x, y, z are x, y, z",
    ),
    "cross-sections": (
        ["3"]
        + [
            w
            for k in range(3)
            for w in (
                f"{-np.sin(np.pi / 3 * k):.6f} {np.cos(np.pi / 3 * k):.6f} 0 1",
                "25 24",
                *rows(POSE)[25 * k : 25 * k + 25],
                *(f"{i} {i + 1} 1 2" for i in range(24)),
            )
        ],
        "",
        "planes",
    ),
}


def written(tmp_path, kind):
    path = tmp_path / f"r.{kind.lower() if kind in ('OBJ', 'PTX') else 'txt'}"
    path.write_text("\n".join(KINDS[kind][0]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_gives_the_same_three_curves_and_says_how_it_was_read(tmp_path, kind):
    _, unit, words = KINDS[kind]
    found = read_curves(written(tmp_path, kind))
    assert words in found.how and "\n" not in found.how
    assert found.unit == unit
    assert [len(curve.points) for curve in found.curves] == [25, 25, 25], found.how
    for curve, true in zip(found.curves, CURVES, strict=True):
        # The files hold four decimals.
        assert curve.points == pytest.approx(true, abs=1e-9)


@pytest.fixture
def file(tmp_path):
    def write(*lines, name="r.csv"):
        path = tmp_path / name
        path.write_text("\n".join(lines) + "\n")
        return path

    return write


NAMED = rows("{k}," + IJK)
HEADER = "curve,x,y,z,nx,ny,nz"


def test_vectors_are_told_apart_by_how_the_curves_lie_to_them(file):
    normals = read_curves(file(HEADER, *NAMED))
    assert all(curve.exact and curve.normal is None for curve in normals.curves)
    # Five decimals.
    assert normals.curves[1].outward == pytest.approx(NORMALS[1], abs=2e-5)
    sides = read_curves(file(HEADER, *rows("{k}," + MM + ",0,0,2")))
    assert not any(curve.exact for curve in sides.curves)
    assert (sides.curves[0].outward == [0.0, 0.0, 1.0]).all()
    across = [f"{-np.sin(a):.6f},{np.cos(a):.6f},0" for a in np.pi / 3 * np.arange(3)]
    lines = [f"{line},{across[i // 25]}" for i, line in enumerate(rows("{k}," + MM))]
    planes = read_curves(file(HEADER, *lines))
    assert all(curve.outward is None for curve in planes.curves)
    assert planes.curves[2].normal == pytest.approx([-np.sin(2.0944), -0.5, 0.0], abs=1e-4)


def test_normals_of_a_flat_face_are_no_planes_and_slices_have_planes(file):
    flat = [f"{k},{i},{k},5,0,0,1" for k in range(4) for i in range(9)]
    assert all(curve.exact for curve in read_curves(file(HEADER, *flat)).curves)
    angles = np.linspace(0.0, 6.0, 40)
    rings = [f"{k},{np.cos(a):.4f},{np.sin(a):.4f},{k},0,0,1" for k in range(4) for a in angles]
    assert all(c.normal is not None for c in read_curves(file(HEADER, *rings)).curves)


def test_vectors_tell_the_outer_side(file):
    inward = [
        line.replace(f",{n[2]:.5f}", f",{-n[2]:.5f}")
        for line, n in zip(
            rows("{k}," + MM + ",0,0,{nz:.5f}"), np.concatenate(NORMALS), strict=True
        )
    ]
    for lines, up in ((rows("{k}," + MM + ",0,0,{nz:.5f}"), 1.0), (inward, -1.0)):
        report = fit_file(file(HEADER, *lines))
        assert report.patch.frame.normal[2] * up > 0.99
        assert "outward side assumed" not in report.flags


@pytest.mark.parametrize("given", ["as columns", "not at all"])
def test_a_tip_is_taken_off_along_the_normals(file, given):
    """Centres of a ball of 1.5 give the curvatures of the contacts, 1 / 40 and 1 / 25."""
    centres = np.concatenate(CURVES) + 1.5 * np.concatenate(NORMALS)
    vectors = np.concatenate(NORMALS) if given == "as columns" else None
    lines = [
        ",".join(
            [
                str(i // 25),
                *(f"{x:.5f}" for x in p),
                *(f"{x:.6f}" for x in ([] if vectors is None else vectors[i])),
            ]
        )
        for i, p in enumerate(centres)
    ]
    path = file(HEADER if given == "as columns" else "curve,x,y,z", *lines)
    k = fit_file(path, options=ReadOptions(tip_radius=1.5)).patch.curvatures
    # Points are rounded to 1e-4 over a patch of 8: 6.71 of that over its square and root of n.
    assert [k.k1, k.k2] == pytest.approx([-1 / 40, -1 / 25], abs=3e-4)
    wrong = fit_file(path).patch.curvatures
    assert abs(wrong.k2 + 1 / 25) > 1.5e-3


def test_failed_points_are_left_out_and_counted(file):
    for name, good, bad in (("hit", "1", "0"), ("State", "OK", "MISSING"), ("fail", "no", "yes")):
        lines = rows("{k}," + MM + f",{good}")
        lines[3] = f"0,12,-3.5,-90,{bad}"
        found = read_curves(file(f"curve,x,y,z,{name}", *lines))
        assert [len(c.points) for c in found.curves] == [24, 25, 25]
        assert f"lines left out: 1 that {name} calls failed" in found.how


def test_columns_can_be_said_by_number_and_by_name(file):
    path = file("a,b,c,d,e", *rows("{k},7," + MM))
    for said in ("x=3,y=4,z=5,curve=1", "x=c, y=d, z=e, curve=a"):
        found = read_curves(path, ReadOptions(columns=said, unit="mm"))
        assert [len(c.points) for c in found.curves] == [25] * 3 and found.unit == "mm"
    for said, words in (
        ("x=3,y=4", "must name x, y and z"),
        ("x=3,y=4,z=9", "has 5 columns: a, b"),
        ("u=3", "give curve, x"),
        ("x=1,y=2,z=3,nx=4", "all of nx, ny, nz"),
    ):
        with pytest.raises(ValueError, match=words):
            read_curves(path, ReadOptions(columns=said))


def test_files_without_three_planes_are_read(file):
    """A single point, a cloud, a long spiral, parallel slices: whatever there is."""
    point = read_curves(file("x,y,z,nx,ny,nz", "1,2,3,0,0,1"))
    assert point.curves[0].name == "" and point.curves[0].exact
    rng = np.random.default_rng(0)
    cloud = read_curves(
        file(*(f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in rng.normal(size=(300, 3))))
    )
    assert [c.name for c in cloud.curves] == [""] and "follow no curve" in cloud.how
    t = np.linspace(0.0, 60.0, 3000)
    spiral = np.stack([np.cos(t), np.sin(t), t / 30], axis=1)
    found = read_curves(file(*(",".join(f"{x:.5f}" for x in p) for p in spiral)))
    assert [len(c.points) for c in found.curves] == [3000] and "one curve" in found.how
    a = np.linspace(0.0, 2 * np.pi, 60)
    lines = [
        f"{60 * k + i} {np.cos(b):.3f} {np.sin(b):.3f} {k}.0"
        for k in range(4)
        for i, b in enumerate(a)
    ]
    assert "slices of equal z" in read_curves(file(*lines)).how


def test_a_raster_that_goes_back_and_forth_is_no_curve(file):
    """Four rows of four, every second one backward, as a control probes a table: along a curve its
    turns would be taken for noise. Two runs of a wavy section are none."""
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    x[1::2] = x[1::2, ::-1]
    rng = np.random.default_rng(1)
    rows = np.column_stack([x.ravel(), y.ravel(), -1.0 + 1e-4 * rng.normal(size=16)])
    path = file(*(f"{a:.4f} {b + 1e-3 * c:.4f} {c:.6f}" for a, b, c in rows))
    found = read_curves(path)
    assert [c.name for c in found.curves] == [""] and "all over an area" in found.how
    with pytest.raises(ValueError, match="too few to tell how noisy they are; give --noise"):
        read_scans([path], options=ReadOptions(unit="mm"))
    s = np.linspace(0.0, 20.0, 120)
    wavy = file(*(f"{a:.4f} {np.sin(a):.4f} {0.1 * a:.4f}" for a in s))
    assert [len(c.points) for c in read_curves(wavy).curves] == [120]


def test_refusals_say_how_the_file_was_read(file):
    with pytest.raises(
        ValueError, match="only 1 curve has .* was read so: cells .* time is column"
    ):
        fit_file(file(*(f"{0.1 * i:.2f},{i}.1,{i * i}.2,{i % 7}.5" for i in range(40))))


def test_twenty_thousand_lines_take_about_a_second(file):
    t = 0.002 * np.arange(20_000)
    lines = [f"{a:.3f},{8 * np.cos(a):.4f},{8 * np.sin(a):.4f},{a:.4f}" for a in t]
    path = file(*lines)
    start = time.process_time()
    assert len(read_curves(path).curves) == 1
    # It is 0.3 s on one core; others may share it.
    assert time.process_time() - start < 3.0


def test_drawings_hold_curves_and_points(tmp_path):
    import ezdxf

    drawing = ezdxf.new(units=4)
    for points in CURVES:
        drawing.modelspace().add_polyline3d(points.tolist())
    drawing.modelspace().add_point((1.0, 2.0, 3.0))
    drawing.saveas(tmp_path / "r.dxf")
    found = read_curves(tmp_path / "r.dxf")
    assert [len(c.points) for c in found.curves] == [25, 25, 25, 1] and found.unit == "mm"


def test_clouds_of_ply_files_keep_their_normals(tmp_path):
    header = ["ply", "format ascii 1.0", "element vertex 75"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    lines = [*header, "end_header", *rows(IJK.replace(",", " "))]
    (tmp_path / "r.ply").write_text("\n".join(lines) + "\n")
    (cloud,) = read_curves(tmp_path / "r.ply").curves
    assert cloud.name == "" and cloud.exact
    # Single precision at 20.
    assert cloud.points[:25] == pytest.approx(CURVES[0], abs=1e-5)
    # The top, where the curves cross, counts once.
    assert len(cloud.points) == 73


def test_scans_of_centres_say_their_tip(file):
    """The atlas takes the tip off, so points stay where they are, with or without normals."""
    tip = ReadOptions(tip_radius=1.5, systematic_std=0.01)
    for header, lines in (("curve,x,y,z", rows("{k}," + MM)), (HEADER, NAMED)):
        found = read_scans([file(header, *lines)], options=tip)
        [scan] = found.scans
        assert (scan.tip_radius, scan.systematic_std) == (1.5, 0.01)
        assert scan.points == pytest.approx(np.concatenate(CURVES)[: len(scan)], abs=1e-4)
        assert found.said[-1] == "points are centres of a tip of radius 1.5"


def test_poses_are_in_metres_unless_no_robot_reaches_so_far(file):
    names = "# timestamp tx ty tz qx qy qz qw"
    near = read_curves(file(names, *rows("{t:.2f} " + POSE + " 0 0 0 1")))
    assert near.unit == "m" and "metres, as poses of robots are in" in near.how
    far = read_curves(file(names, *rows("{t:.2f} 5{px:.4f} {py:.4f} {pz:.4f} 0 0 0 1")))
    assert far.unit == ""
