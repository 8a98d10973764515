"""One recording, written as measuring machines, robots, controls and cameras write it.

docs/files.md says where each form is from.
"""

import numpy as np

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
