"""Files of curves and meshes as people, machines, robots and cameras write them, made at random.

    python examples/good_files.py [SEED]

It prints a log of three curves through the top of a ball. `fuzz_files.py` damages such files.
"""

import sys
from itertools import count

import numpy as np
import trimesh

MESHES = ("ply", "stl", "obj", "off")


def curves_of_a_ball(rng) -> list[np.ndarray]:
    """Three curves (n, 3) through the top of a ball."""
    found = []
    for angle in (0.0, 1.05, 2.09):
        s = np.linspace(-10.0, 10.0, int(rng.integers(4, 14)))
        found.append(np.stack([s * np.cos(angle), s * np.sin(angle), np.sqrt(900.0 - s * s)], 1))
    return found


def good_csv(rng) -> bytes:
    """Three curves through the top of a ball, in one of the ways in which people write them."""
    if rng.random() < 0.5:
        return good_log(rng)
    separator = [",", ";", "\t", " "][rng.integers(4)]
    comma = separator != "," and rng.random() < 0.5
    lines = [["curve", "x", "y", "z"], ["contour_id", "px [mm]", "py [mm]", "pz [mm]"]]
    rows = [lines[rng.integers(2)]] if separator != " " else []
    for number, curve in enumerate(curves_of_a_ball(rng)):
        for cells in (curve + 0.01 * rng.normal(size=curve.shape)).round(4).astype(str):
            rows.append([f"{number}", *(c.replace(".", ",") if comma else c for c in cells)])
    return "\n".join(separator.join(row) for row in rows).encode()


# A line of a point in logs of machines, robots and cameras, and the lines around all of them.
LOGS = (
    ("", "[PRB:{x:.3f},{y:.3f},{z:.3f}:1]\nok"),
    ("G21\n", "G1 X{x:.3f} Y{y:.3f} Z{z:.3f}"),
    ("UNITS/MM,ANGDEC\nMEAS/GCURVE,F(A)\n", "PTMEAS/CART,{x:.3f},{y:.3f},{z:.3f},0,0,1"),
    ("", "ACTL/<{x:.3f},{y:.3f},{z:.3f}>,<0,0,1>"),
    ("", "position:\n  x: {x:.3f}\n  y: {y:.3f}\n  z: {z:.3f}\n---"),
    ("", '{{"x": {x:.3f}, "y": {y:.3f}, "z": {z:.3f}}}'),
    ("# timestamp tx ty tz qx qy qz qw\n", "{t:.2f} {x:.3f} {y:.3f} {z:.3f} 0 0 0 1"),
    ("Device,A\nUnit,mm\n\nprofile,X,Y,Z,valid\n", "{k},{x:.3f},{y:.3f},{z:.3f},1"),
    ("Name;X nom;Y nom;Z nom;X act;Y act;Z act\n", "S{k}.{t};0;0;0;{x:.3f};{y:.3f};{z:.3f}"),
    ("", "{x:.3f} {y:.3f} {z:.3f} 0 0 0 0 0 0"),
    ("UNITS/MM\n", "GOTO/ {x:.3f}, {y:.3f}, {z:.3f}, 0, 0, 1"),
    ("", "// probe at {x:.3f},{y:.3f} is z={z:.3f}"),
    ("MODULE A\n", "CONST robtarget p{t}:=[[{x:.3f},{y:.3f},{z:.3f}],[1,0,0,0],[0,0,0,0]];"),
    ("/POS\n", "P[{t}] {{\n X = {x:.3f} mm, Y = {y:.3f} mm, Z = {z:.3f} mm,\n}};"),
    ("", "P{t}, X={x:.3f}, Y={y:.3f}, Z={z:.3f}, I=0, J=0, K=1"),
)


def good_log(rng) -> bytes:
    """Three curves through the top of a ball, as a machine, robot or camera logs them."""
    head, form = LOGS[rng.integers(len(LOGS))]
    gap = ["", "\n", "# next\n", "NaN,NaN,NaN\n"][rng.integers(4)]
    written, times = [], count(1)
    for k, curve in enumerate(curves_of_a_ball(rng)):
        lines = [form.format(x=x, y=y, z=z, t=next(times), k=k) + "\n" for x, y, z in curve]
        written.append("".join(lines))
    return (head + gap.join(written)).encode()


def good_polygons(rng) -> bytes:
    """A prism over an L, whose faces are concave polygons, as binary or text PLY, OBJ or OFF."""
    corners = [[2, 1], [1, 1], [1, 2], [0, 2], [0, 0], [2, 0]]
    points = [[*corner, z] for z in (0, 1) for corner in corners]
    faces = [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11]]
    faces += [[i, (i + 1) % 6, 6 + (i + 1) % 6, 6 + i] for i in range(6)]
    kind = ("ply", "obj", "off")[rng.integers(3)]
    sizes = [[len(face), *face] for face in faces]
    if kind == "obj":
        lines = [["v", *point] for point in points]
        lines += [["f", *(i + 1 for i in face)] for face in faces]
    else:
        lines = [["OFF"], [12, len(faces), 0], *points, *sizes]
    if kind != "ply":
        return f"{kind}:".encode() + "\n".join(" ".join(map(str, line)) for line in lines).encode()
    binary = rng.random() < 0.5
    head = f"ply\nformat {'binary_little_endian' if binary else 'ascii'} 1.0\nelement vertex 12\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz") + f"element face {len(faces)}\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    body = "\n".join(" ".join(map(str, line)) for line in (*points, *sizes)).encode() + b"\n"
    if binary:
        body = np.array(points, "<f4").tobytes()
        body += b"".join(bytes([n]) + np.array(face, "<i4").tobytes() for n, *face in sizes)
    return b"ply:" + head.encode() + body


def good_mesh(rng) -> bytes:
    """A small body as PLY, STL, OBJ or OFF."""
    if rng.random() < 0.4:
        return good_polygons(rng)
    mesh = (
        trimesh.creation.icosphere(subdivisions=1) if rng.random() < 0.5 else trimesh.creation.box()
    )
    kind = MESHES[rng.integers(len(MESHES))]
    options = {"encoding": "ascii"} if kind == "ply" and rng.random() < 0.5 else {}
    data = mesh.export(file_type=kind, **options)
    return kind.encode() + b":" + (data if isinstance(data, bytes) else data.encode())


if __name__ == "__main__":
    print(good_log(np.random.default_rng(int(*sys.argv[1:]))).decode())
