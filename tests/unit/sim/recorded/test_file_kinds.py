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


def rows(form, gap=None):
    """Lines of all points by a format of curve, point, time, coordinates and normal; ``gap`` is a
    format of what stands before the curves after the first."""
    lines = []
    for k, (points, normals) in enumerate(zip(CURVES, NORMALS, strict=True)):
        lines += [gap.format(k=k)] if gap is not None and k else []
        for i, (point, normal) in enumerate(zip(points, normals, strict=True)):
            px, py, pz = place = [f"{x:.4f}" for x in point]
            nx, ny, nz = [f"{x:.5f}" for x in normal]
            cells = {"px": px, "py": py, "pz": pz, "p": point, "nx": nx, "ny": ny, "nz": nz}
            cells |= {"mm": ",".join(place), "pose": " ".join(place), "semi": ";".join(place)}
            lines.append(form.format(k=k, i=i, j=25 * k + i, t=30 * k + 0.05 * i, **cells))
    return lines


def kind(form, words, unit="", head=None, gap=None, tail=None, change=("", "")):
    """What is in a file, a unit that it says, and words of how it was read."""
    parts = head, "\n".join(rows(form, gap)), tail
    text = "\n".join(part for part in parts if part is not None)
    return text.replace(*change) if change[0] else text, unit, words


OPTITRACK = "Format Version,1.23,Length Units,Meters\n,,Tip,Tip,Tip\n,,Position,Position,Position"
JOINTS, TCP = (" ".join(f"actual_{name}_{i}" for i in range(6)) for name in ("q", "TCP_pose"))
FRANKA = "time, " + ", ".join(f"state.O_T_EE[{i}]" for i in range(16))
ROS = [f"orientation.{axis}" for axis in "xyzw"]
ROSTOPIC = ",".join(f"field.pose.{n}" for n in (*(f"position.{axis}" for axis in "xyz"), *ROS))
ECHO = "pose:\n  position:\n    x: {px}\n    y: {py}\n    z: {pz}\n"
ECHO += "  orientation:\n    x: 0.0\n    y: 0.0\n    z: 0.0\n    w: 1.0\n---"
EUROC = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
EUROC += "q_RS_z []"
PCD = "# .PCD v.7\nVERSION .7\nFIELDS x y z normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4\n"
PCD += "TYPE F F F F F F\nCOUNT 1 1 1 1 1 1\nDATA ascii"
PTX = "25\n3\n" + "1 0 0\n" * 4 + "1 0 0 0\n" * 3 + "1 0 0 0"
FANUC = "P[1] {{\nUF : 6, UT : 5,\nX = {px} mm, Y = {py} mm, Z = {pz} mm,\n"
FANUC += "W = 0.0 deg, P = 0.0 deg, R = 0.0 deg"
RAPID = (
    "CONST robtarget p{j}:=[[{mm}],[1,0,0,0],[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];"
)
EDGES = [f"{i} {i + 1} 1 2" for i in range(24)]
LINES = "\n".join(f"l {25 * k + i + 1} {25 * k + i + 2}" for k in range(3) for i in range(24))
FAR = "frame,epoch,x,y,z,vx,vy,vz"
KINDS = {
    "bare": kind("{pose}", "by jumps"),
    "blank lines": kind("{mm}", "by empty lines", gap=""),
    "double spaced": kind("{mm}\n", "by jumps"),
    "NaN": kind("{mm}", "by lines of NaN", head="x,y,z", gap="NaN,NaN,NaN"),
    "comments": kind("{pose}", "by lines of words", gap="# next"),
    "trailing commas": kind("{mm},", "by jumps"),
    "brackets": kind("({px}, {py}, {pz})", "by empty lines", gap=""),
    "minus sign": kind("{mm}", "by jumps", change=("-", "\u2212")),
    "metadata": kind("{k},{mm}", "profile", "mm", "Device,LJ\nUnit,mm\n\nprofile,X,Y,Z"),
    "counter": kind("{j} {pose}", "ignored: column 1"),
    "time": kind("{t:.2f},{mm}", "time is column 1"),
    "point names": kind("S{k}.{i};{semi}", "without", head="Name;X;Y;Z"),
    "English": kind("F{k},{mm}", "Feature", head="Feature,X Actual,Y Actual,Z Actual"),
    "German": kind(
        *("E{k};{i};{semi};{nx};{ny};{nz}", "column Element"),
        head="Element;Pkt;X-Wert;Y-Wert;Z-Wert;Nx;Ny;Nz",
        change=(".", ","),
    ),
    "French": kind(
        *("{k};{semi}", "Courbe", "mm"),
        head="Courbe;Coordonnée X (mm);Coordonnée Y (mm);Coordonnée Z (mm)",
    ),
    "Italian": kind(
        *("{k};{semi};1;2;{i}", "X misurato"),
        head="Curva;X misurato;Y misurato;Z misurato;X teorico;Y teorico;Z teorico",
    ),
    "Spanish": kind("P{k};{semi}", "Perfil", head="Perfil;Coordenada X;Coordenada Y;Coordenada Z"),
    "Japanese": kind("{k},{mm}", "曲線", head="曲線,X座標,Y座標,Z座標"),
    "nominal and actual": kind(
        "S{k};1;2;{i};{semi}", "Xact", head="S;Xnom;Ynom;Znom;Xact;Yact;Zact"
    ),
    "target": kind("1,2,{i},{mm},{k}", "line", head="target_x,target_y,target_z,x,y,z,line"),
    "DMIS": kind(
        *("PTMEAS/CART,{mm},{nx},{ny},{nz}", "words", "mm", "UNITS/MM,ANGDEC\nMEAS/GCURVE,F(A),25"),
        gap="ENDMES\nMEAS/GCURVE,F(B),25",
    ),
    "PC-DMIS": kind("THEO/<1,2,3>,<0,0,1>\nACTL/<{mm}>,<{nx},{ny},{nz}>", "ACTL/"),
    "grbl": kind("G38.2 Z-9\n[PRB:{mm}:1]\nok", "PRB"),
    "PROBEOPEN": kind("{pose}" + " 0.0" * 6, "by jumps"),
    "G-code": kind("G1 X{px} Y{py} Z{pz}", "G-code", "mm", head="G21", gap="G0 Z90"),
    "rostopic": kind("{t:.2f},{mm},0,0,0,1", "position.x", "m", head=f"%time,{ROSTOPIC}"),
    "ros2 csv": kind("17000,{i},base,{mm},0.0,0.0,0.0,1.0", "column 4, column 5", "m"),
    "ros2 echo": kind(ECHO, "x:, y:, z:"),
    "JSON lines": kind('{{"t": {t:.2f}, "x": {px}, "y": {py}, "z": {pz}}}', "x, y, z"),
    "TUM": kind("{t:.2f} {pose} 0 0 0 1", "tx", "m", "# timestamp tx ty tz qx qy qz qw"),
    "EuRoC": kind("{t:.2f},{mm},1,0,0,0", "p_RS_R_x", "m", head=EUROC),
    "KITTI": kind("1 0 0 {px} 0 1 0 {py} 0 0 1 {pz}", "column 4, column 8", "m"),
    "RTDE": kind(
        *("{t:.2f} 1 2 3 4 5 6 {pose} 0 3.1 0", "actual_TCP_pose_0", "m"),
        head=f"timestamp {JOINTS} {TCP}",
    ),
    "libfranka": kind("{t:.2f},1,0,0,0,0,1,0,0,0,0,1,0,{mm},1", "O_T_EE[12]", "m", head=FRANKA),
    "Motive": kind("{j},{t:.2f},{mm}", "X, Y, Z", "m", f"{OPTITRACK}\nFrame,Time (Seconds),X,Y,Z"),
    "Qualisys": kind(
        *("{j}\t{t:.2f}\t{px}\t{py}\t{pz}", "Tip X", ""),
        head="NO_OF_FRAMES\t75\nMARKER_NAMES\tTip\nFrame\tTime\tTip X\tTip Y\tTip Z",
    ),
    "tracker": kind(
        *("{j},OK,1,0,0,0,{mm},0.2", "State calls failed"),
        head="Frame,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error",
        tail="99,MISSING,0,0,0,0,0,0,0,0",
    ),
    "PCD": kind(
        *("{pose} {nx} {ny} {nz}", "normals of the surface"),
        head=PCD,
    ),
    "PTS": kind("{pose} 12 200 201 202", "column 1, column 2", head="75"),
    "CloudCompare": kind("{mm},{k:.6f}", "cloud_index", head="//X,Y,Z,Original_cloud_index"),
    "OBJ": kind("v {pose}", "ending .obj", tail=LINES),
    "Heidenhain": kind(
        *("{j} L X{p[0]:+.4f} Y{p[1]:+.4f} Z{p[2]:+.4f} R0 F500", "X, Y, Z", "mm"),
        head="BEGIN PGM 1 MM",
    ),
    "KUKA": kind("{{X {px},Y {py},Z {pz},A 0,B 0,C 180}}", "after x, y, z"),
    "Fanuc": kind("P[{j}]{{ X = {px} mm, Y = {py} mm, Z = {pz} mm }};", "after x", "mm"),
    "ABB": kind("[[{mm}],[1,0,0,0]]", "column 1, column 2, column 3", "m"),
    "JSON list": ("[" + ",".join(rows("[{mm}]")) + "]", "", "by jumps"),
    "XML": kind('<p x="{px}" y="{py}" z="{pz}"/>', "after x", head="<p>", tail="</p>"),
    "units in cells": kind("{px} mm,{py} mm,{pz} mm", "after each", "mm", head="x,y,z"),
    "Fortran": kind("{p[0]:.9e} {p[1]:.9e} {p[2]:.9e}", "jumps", change=("e", "D")),
    "PTX": kind("{pose} 0.5", "column 4", head=PTX),
    "nines": kind(
        *("{mm}", "left out: 2 without coordinates"), head="x,y,z", gap="-9999,-9999,-9999"
    ),
    "status": kind(
        "{j};{semi};OK", "Status calls failed", head="Punkt;X;Y;Z;Status", tail="99;0;0;0;Fehler"
    ),
    "Fanuc program": kind(
        *(FANUC, "after x, y, z", "mm"),
        head="\n".join(["/PROG  A", "/MN", *rows("{j}: L P[{j}] 60cm/min CNT100 ;"), "/POS"]),
    ),
    "RAPID program": kind(
        *(RAPID, "robtarget", "mm", "MODULE A"), tail="\n".join(rows("MoveL p{j},v100,z1,tool0;"))
    ),
    "KUKA program": kind(
        *("LIN {{X {px},Y {py},Z {pz},A 0.0,B 90.0,C 0.0,E1 0}} C_DIS", "by lines of words", ""),
        *("DEF A ( )", "PTP {{A1 0.0, A2 -90.0, A3 90.0}}"),
    ),
    "APT": kind(
        *("GOTO/ {px}, {py}, {pz}, {nx}, {ny}, {nz}", "normals of the surface", "mm"),
        *("PARTNO/A\nUNITS/MM", "RAPID"),
    ),
    "Klipper": kind("21:09:48\n// probe at {px},{py} is z={pz}", "probe at"),
    "Marlin": kind("X:{px} Y:{py} Z:{pz} E:0.0 Count 0 2743 1830\nok", "after x, y, z"),
    "SmartElectrode": kind(
        "P{j}, X={px}, Y={py}, Z={pz}, I={nx}, J={ny}, K={nz}",
        "normals of the surface",
    ),
    "SpatialAnalyzer": kind("A Scan{k} p{i} {pose}", "curves by column 2", head="// SA 2026"),
    "tcp in mm": kind(
        *("{t:.3f},{mm},0,0,1", "tcp_x_mm", "mm"),
        head="elapsed_sec,tcp_x_mm,tcp_y_mm,tcp_z_mm,tcp_ox,tcp_oy,tcp_oz",
    ),
    "JSON objects": (
        "[" + ",".join(rows('{{"x":{px},"y":{py},"z":{pz},"roll":-2.8,"yaw":0.1}}')) + "]",
        *("", "after x, y, z"),
    ),
    "frames": kind("{mm}", "by empty lines", "", "# frame 0\nx,y,z", "\n# frame {k}\nx,y,z", ""),
    "spacecraft": kind(
        "J2000,2026-11-28T00:00:{t:06.3f} UTC,{mm},1,2,3", "x, y, z are x, y, z", head=FAR
    ),
    "cross-sections": (
        "3\n"
        + "\n".join(
            f"{-np.sin(np.pi / 3 * k):.6f} {np.cos(np.pi / 3 * k):.6f} 0 1\n25 24\n"
            + "\n".join([*rows("{pose}")[25 * k : 25 * k + 25], *EDGES])
            for k in range(3)
        ),
        *("", "planes"),
    ),
}


def written(tmp_path, kind):
    path = tmp_path / f"r.{kind.lower() if kind in ('OBJ', 'PTX') else 'txt'}"
    path.write_text(KINDS[kind][0] + "\n", encoding="utf-8")
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


NAMED = rows("{k},{mm},{nx},{ny},{nz}")
HEADER = "curve,x,y,z,nx,ny,nz"


def test_vectors_are_told_apart_by_how_the_curves_lie_to_them(file):
    normals = read_curves(file(HEADER, *NAMED))
    assert all(curve.exact and curve.normal is None for curve in normals.curves)
    # Five decimals.
    assert normals.curves[1].outward == pytest.approx(NORMALS[1], abs=2e-5)
    sides = read_curves(file(HEADER, *rows("{k},{mm},0,0,2")))
    assert not any(curve.exact for curve in sides.curves)
    assert (sides.curves[0].outward == [0.0, 0.0, 1.0]).all()
    across = [f"{-np.sin(a):.6f},{np.cos(a):.6f},0" for a in np.pi / 3 * np.arange(3)]
    lines = [f"{line},{across[i // 25]}" for i, line in enumerate(rows("{k},{mm}"))]
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
        for line, n in zip(rows("{k},{mm},0,0,{nz}"), np.concatenate(NORMALS), strict=True)
    ]
    for lines, up in ((rows("{k},{mm},0,0,{nz}"), 1.0), (inward, -1.0)):
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
        lines = rows(f"{{k}},{{mm}},{good}")
        lines[3] = f"0,12,-3.5,-90,{bad}"
        found = read_curves(file(f"curve,x,y,z,{name}", *lines))
        assert [len(c.points) for c in found.curves] == [24, 25, 25]
        assert f"lines left out: 1 that {name} calls failed" in found.how


def test_columns_can_be_said_by_number_and_by_name(file):
    path = file("a,b,c,d,e", *rows("{k},7,{mm}"))
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
    lines = [*header, "end_header", *rows("{pose} {nx} {ny} {nz}")]
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
    for header, lines in (("curve,x,y,z", rows("{k},{mm}")), (HEADER, NAMED)):
        found = read_scans([file(header, *lines)], options=tip)
        [scan] = found.scans
        assert (scan.tip_radius, scan.systematic_std) == (1.5, 0.01)
        assert scan.points == pytest.approx(np.concatenate(CURVES)[: len(scan)], abs=1e-4)
        assert found.said[-1] == "points are centres of a tip of radius 1.5"


def test_poses_are_in_metres_unless_no_robot_reaches_so_far(file):
    names = "# timestamp tx ty tz qx qy qz qw"
    near = read_curves(file(names, *rows("{t:.2f} {pose} 0 0 0 1")))
    assert near.unit == "m" and "metres, as poses of robots are in" in near.how
    far = read_curves(file(names, *rows("{t:.2f} 5{pose} 0 0 0 1")))
    assert far.unit == ""
