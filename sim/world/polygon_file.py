"""Mesh files with polygons: PLY, OBJ and OFF, each polygon cut into triangles inside of it.

trimesh cuts polygons as fans, which leave a concave one, and refuses binary PLY files whose faces
differ in their number of corners. Files of triangles alone are left to it.
"""

import re
import struct
from pathlib import Path
from typing import Any

import numpy as np

# A line of a face with four corners or more, as OBJ and as OFF and text PLY write it.
_MANY = re.compile(
    rb"^[ \t]*(?:f(?:[ \t]+[-\d/]+){4,}|(?:[4-9]|[1-9]\d+)(?:[ \t]+\d+){4,})[ \t]*(?:\\|#.*)?\r?$",
    re.M,
)
_FACES = re.compile(
    rb"element vertex (\d+)(.*?)element face (\d+)\s+property list uchar u?int", re.S
)
_TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I"}
_TYPES |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"}
_TYPES |= {"float": "f", "double": "d", "float32": "f", "float64": "d"}


def load_polygons(path: Path):
    """Vertices (v, 3) and triangles (f, 3) of a file with larger polygons; None for other files.

    Raises
    ------
    Exception
        Of any kind where the file is damaged; ``load_mesh`` makes it a sentence.
    """
    reader = {".ply": _read_ply, ".obj": _read_obj, ".off": _read_off}.get(path.suffix.lower())
    if reader is None or not _may_hold_polygons(path.read_bytes()):
        return None
    vertices, polygons = reader(path)
    if not any(len(polygon) > 3 for polygon in polygons):
        return None
    vertices = np.asarray(vertices, float).reshape(-1, 3)
    faces = [triangle for polygon in polygons for triangle in triangulated(vertices, polygon)]
    return vertices, np.array(faces, np.int64).reshape(-1, 3)


def _may_hold_polygons(data: bytes) -> bool:
    """Whether a face may have more than three corners: told without reading numbers."""
    header, _, body = data.partition(b"end_header")
    if not data.startswith(b"ply"):
        return _MANY.search(data) is not None
    if b"format ascii" in header:
        return _MANY.search(body) is not None
    found = _FACES.search(header)
    if not found or b"list" in found[2] or header.count(b"property list") > 1:
        return b"property list" in header
    kinds = re.findall(rb"property (\w+) ", found[2])
    size = sum(struct.calcsize(_TYPES[kind.decode()]) for kind in kinds)
    counts = body[body.index(b"\n") + 1 :][int(found[1]) * size :][::13][: int(found[3])]
    return counts.strip(b"\3") != b""


def triangulated(vertices, polygon) -> list[tuple[int, int, int]]:
    """Triangles of a polygon of vertices (v, 3), by ear clipping in its plane (Meisters, 1975).

    Examples
    --------
    An L of area 3, which a fan from its first corner would leave:

    >>> corners = np.array([[2, 1], [1, 1], [1, 2], [0, 2], [0, 0], [2, 0.0]])
    >>> corners = np.c_[corners, np.zeros(6)]
    >>> faces = np.array(triangulated(corners, [0, 1, 2, 3, 4, 5]))
    >>> a, b, c = corners[faces].transpose(1, 0, 2)
    >>> float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
    3.0
    """
    left = [int(v) for v in polygon]
    points = vertices[left] - vertices[left[0]]
    normal = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    fan = [(left[0], b, c) for b, c in zip(left[1:], left[2:], strict=False)]
    sides = np.cross(points[1:-1], points[2:]) @ normal
    if len(left) < 5 and (sides >= 0.0).all() or not normal.any():
        return fan
    if (sides > 0.0).all() and _is_convex(points, normal):
        return fan
    place = dict(zip(left, points, strict=True))
    found: list[tuple[int, int, int]] = []
    while len(left) > 3:
        ear = next((i for i in range(len(left)) if _is_ear(left, i, place, normal)), None)
        if ear is None:
            # It crosses itself.
            break
        found.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        left.pop(ear)
    return found + [(left[0], b, c) for b, c in zip(left[1:], left[2:], strict=False)]


def _is_convex(points, normal) -> bool:
    """Whether a polygon (n, 3) turns one way at all its corners."""
    side = np.roll(points, -1, axis=0) - points
    return bool((np.cross(side, np.roll(side, -1, axis=0)) @ normal >= 0.0).all())


def _is_ear(left: list[int], i: int, place: dict, normal) -> bool:
    """Whether corner i is convex and no other corner lies in its triangle."""
    names = left[i - 1], left[i], left[(i + 1) % len(left)]
    a, b, c = (place[name] for name in names)
    if np.cross(b - a, c - b) @ normal <= 0.0:
        return False
    others = np.array([place[v] for v in left if v not in names])
    sides = [np.cross(q - p, others - p) @ normal for p, q in ((a, b), (b, c), (c, a))]
    return not (np.min(sides, axis=0) >= 0.0).any()


def _read_obj(path: Path):
    # A line that ends in a backslash goes on.
    text = re.sub(r"\\\r?\n", " ", path.read_text(errors="replace"))
    rows = [line.partition("#")[0].split() for line in text.splitlines()]
    vertices = [[float(x) for x in row[1:4]] for row in rows if row and row[0] == "v"]
    polygons, count = [], 0
    for row in rows:
        count += bool(row) and row[0] == "v"
        if row and row[0] == "f":
            corners = [int(word.split("/")[0]) for word in row[1:]]
            polygons.append([k - 1 if k > 0 else count + k for k in corners])
    return vertices, polygons


def _read_off(path: Path):
    lines = path.read_text(errors="replace").splitlines()
    words = [line.partition("#")[0].split() for line in lines]
    numbers = [row for row in words if row]
    if numbers[0][0].upper() != "OFF":
        return [], []
    numbers = numbers[1:] if len(numbers[0]) == 1 else [numbers[0][1:], *numbers[1:]]
    count, faces = int(numbers[0][0]), int(numbers[0][1])
    vertices = [[float(x) for x in row[:3]] for row in numbers[1 : 1 + count]]
    rows = numbers[1 + count : 1 + count + faces]
    return vertices, [[int(x) for x in row[1 : 1 + int(row[0])]] for row in rows]


def _read_ply(path: Path):
    data = path.read_bytes()
    end = data.index(b"\n", data.index(b"end_header")) + 1
    header = [line.split() for line in data[:end].decode("ascii", "replace").splitlines()]
    elements: list[tuple[str, int, list[list[str]]]] = []
    for line in header:
        if line[:1] == ["element"]:
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == ["property"]:
            elements[-1][2].append(line[1:])
    kind = next(line[1] for line in header if line[:1] == ["format"])
    faces = next((e for e in elements if e[0] == "face"), None)
    if faces is None or not any(p[0] == "list" for p in faces[2]):
        return [], []
    if kind == "ascii":
        tables = _text_elements(data[end:], elements)
    else:
        tables = _binary_elements(data, end, elements, "<" if "little" in kind else ">")
    vertices = np.stack([tables["vertex"][axis] for axis in "xyz"], axis=1)
    name = next(p[-1] for p in faces[2] if p[0] == "list" and "ind" in p[-1])
    return vertices, tables["face"][name]


def _text_elements(data: bytes, elements) -> dict[str, dict[str, list]]:
    words = iter(data.split())
    tables: dict[str, dict[str, list]] = {}
    for element, count, properties in elements:
        table: dict[str, list] = {p[-1]: [] for p in properties}
        for _ in range(count):
            for p in properties:
                if p[0] == "list":
                    table[p[-1]].append([int(float(next(words))) for _ in range(int(next(words)))])
                else:
                    table[p[-1]].append(float(next(words)))
        tables[element] = table
    return tables


def _binary_elements(data: bytes, at: int, elements, order: str) -> dict[str, Any]:
    tables: dict[str, Any] = {}
    for element, count, properties in elements:
        if not any(p[0] == "list" for p in properties):
            kind = np.dtype([(p[-1], order + _TYPES[p[0]]) for p in properties])
            tables[element] = np.frombuffer(data, kind, count, at)
            at += count * kind.itemsize
            continue
        table: dict[str, list] = {p[-1]: [] for p in properties}
        for _ in range(count):
            for p in properties:
                if p[0] == "list":
                    (length,) = struct.unpack_from(order + _TYPES[p[1]], data, at)
                    at += struct.calcsize(_TYPES[p[1]])
                    form = f"{order}{length}{_TYPES[p[2]]}"
                else:
                    form = order + _TYPES[p[0]]
                values = struct.unpack_from(form, data, at)
                at += struct.calcsize(form)
                table[p[-1]].append(values if p[0] == "list" else values[0])
        tables[element] = table
    return tables
