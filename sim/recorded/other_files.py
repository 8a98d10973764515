"""Files of points that are no tables: PLY and OBJ by trimesh, DXF by ezdxf, and cross-sections."""

from pathlib import Path

import numpy as np

from touchatlas.sim.world.units import UNITS

Group = tuple[str, np.ndarray, np.ndarray]


def read_other(path: Path) -> tuple[list[Group], str] | None:
    """Curves of a file by its ending, and its unit; None where it is read as a table.

    Raises
    ------
    ValueError
        In one sentence: the file is damaged, or its reader is not installed.
    """
    reader = {".ply": _ply, ".obj": _obj, ".dxf": _dxf}.get(path.suffix.lower())
    if reader is None:
        return None
    try:
        groups, unit = reader(path)
    except ImportError:
        raise ValueError(
            f"{path} is a DXF file, which needs `pip install 'touchatlas[formats]'`"
        ) from None
    except Exception as error:  # noqa: BLE001 - readers raise whatever they meet.
        words = " ".join(str(error).split())[:200]
        raise ValueError(f"{path} can't be read as {path.suffix[1:].upper()}: {words}") from None
    if not groups:
        raise ValueError(f"{path} holds no points or curves")
    return groups, unit


def _bare(name: str, points) -> Group:
    points = np.asarray(points, dtype=float)
    return name, points, np.full(points.shape, np.nan)


def _ply(path: Path):
    """Vertices of a PLY file, with their normals if it holds them."""
    import trimesh

    mesh = trimesh.load(path, process=False)
    vertex = mesh.metadata["_ply_raw"].get("vertex", {})
    if not vertex.get("length"):
        return [], ""
    data = vertex["data"]
    columns = [np.asarray(data[n], dtype=float).ravel() for n in ("x", "y", "z")]
    points = np.stack(columns, axis=1)
    held = data.dtype.names if getattr(data, "dtype", None) is not None else list(data)
    if not {"nx", "ny", "nz"} <= set(held or ()):
        return [_bare("", points)], ""
    normals = np.stack([np.asarray(data[n], dtype=float).ravel() for n in ("nx", "ny", "nz")], 1)
    return [("", points, normals)], ""


def _obj(path: Path):
    """Lines of an OBJ file as curves; its vertices as scattered points where it has no line."""
    rows = [line.split() for line in path.read_text(errors="replace").splitlines()]
    vertices = np.array([row[1:4] for row in rows if row and row[0] == "v"], dtype=float)
    lines = [[int(word.split("/")[0]) for word in row[1:]] for row in rows if row and row[0] == "l"]
    if not lines:
        return [_bare("", vertices)] if len(vertices) else [], ""
    ends = np.array([pair for line in lines for pair in zip(line, line[1:], strict=False)])
    chains = _chains(ends - (ends > 0))
    return [_bare(f"{k}", vertices[chain]) for k, chain in enumerate(chains, 1)], ""


def _dxf(path: Path):
    """Curves and points of the model space of a DXF file, and its unit."""
    import ezdxf
    from ezdxf.path import make_path
    from ezdxf.units import unit_name

    document = ezdxf.readfile(path)
    unit = UNITS.get(unit_name(document.units).lower(), "")
    points: list[list[float]] = []
    groups: list[Group] = []
    for entity in document.modelspace():
        if entity.dxftype() == "POINT":
            points.append(list(entity.dxf.location))
        elif entity.dxftype() in ("LINE", "LWPOLYLINE", "POLYLINE", "SPLINE", "ARC", "CIRCLE"):
            route = make_path(entity)
            corners = [list(p) for p in route.control_vertices()]
            span = max(float(np.ptp(corners, axis=0).max()), np.finfo(float).tiny)
            # Straight parts keep their corners; a thousandth of the size is the sagitta elsewhere.
            line = [list(p) for p in route.flattening(1e-3 * span)]
            groups.append(_bare(f"{len(groups) + 1}", line))
    return [*groups, *([_bare("", points)] if points else [])], unit


def cross_sections(path: Path) -> list[tuple[str, np.ndarray, np.ndarray]] | None:
    """Curves of a file of cross-sections, each with the normal of its plane; None for others.

    The number of planes; for each plane its a, b, c, d, the numbers of vertices and edges, the
    vertices, and edges as two vertices and two materials (Liu et al. 2008, "Surface reconstruction
    from non-parallel curve networks").
    """
    with path.open("rb") as file:
        if not file.readline(32).strip().isdigit():
            return None
    try:
        numbers = [float(word) for word in path.read_text().split()]
        count, at = int(numbers[0]), 1
        curves: list[Group] = []
        for _ in range(count):
            normal = np.array(numbers[at : at + 3])
            vertices, edges = (int(n) for n in numbers[at + 4 : at + 6])
            start, end = at + 6, at + 6 + 3 * vertices
            at = end + 4 * edges
            points = np.array(numbers[start:end]).reshape(vertices, 3)
            ends = np.array(numbers[end:at]).reshape(edges, 4)[:, :2].astype(int)
            for part in _chains(ends):
                curves.append((f"{len(curves) + 1}", points[part], np.tile(normal, (len(part), 1))))
    except (ValueError, IndexError, OverflowError):
        return None
    return curves if curves and at == len(numbers) else None


def _chains(edges) -> list[list[int]]:
    """Vertices in order of travel along edges (m, 2), chain by chain."""
    beside: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    chains, seen = [], set()
    for start in sorted(beside, key=lambda v: len(beside[v]) != 1):
        if start in seen:
            continue
        chain = [start]
        seen.add(start)
        while nearby := [v for v in beside[chain[-1]] if v not in seen]:
            chain.append(nearby[0])
            seen.add(nearby[0])
        if len(chain) > 2 and start in beside[chain[-1]]:
            chain.append(start)
        chains.append(chain)
    return chains
