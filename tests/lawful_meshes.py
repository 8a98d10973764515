"""Bodies of planes, cylinders and spheres as triangles."""

from functools import lru_cache, partial

import numpy as np
import trimesh

from touchatlas.sim.world.mesh_object import MeshObject

# Half of the sides of the box, radius and half of the height of the cylinder.
HALF = np.array([30.0, 20.0, 15.0])
RADIUS, HALF_HEIGHT = 20.0, 25.0
# Half of the sides of a plate, the third of which is its thickness.
PLATE = np.array([30.0, 20.0, 2.0])
# Corners of profiles, triangles of corners that fill them, counted from 0 to b, and heights.
_PROFILES = {
    # The edge at (30, 20) is concave.
    "step": ("0,0 30,0 60,0 60,40 30,40 30,20 0,20", "015 056 123 135 534", 30.0),
    "stairs": (
        "0,0 20,0 40,0 60,0 60,10 40,10 40,20 20,20 20,30 0,30",
        "019 189 178 127 267 256 235 345",
        40.0,
    ),
    # As a machine table has it.
    "T-slot": (
        "-30,0 30,0 30,34 6,34 6,22 16,22 16,12 -16,12 -16,22 -6,22 -6,34 -30,34",
        "016 067 125 156 234 245 078 08b b89 b9a",
        40.0,
    ),
    # Joined by a neck: of the line y = 0 one part faces up and the other down.
    "two blocks": (
        "-30,-20 -5,-20 5,-20 5,0 30,0 30,20 5,20 -5,20 -5,0 -30,0",
        "018 089 123 138 836 867 345 356",
        30.0,
    ),
    "wall on a slab": (
        "-30,0 -4,0 4,0 30,0 30,4 4,4 4,24 -4,24 -4,4 -30,4",
        "018 089 125 158 234 245 856 867",
        30.0,
    ),
}
# Radius of the edges of a rounded box, of the concave edge of two filleted steps, and of the
# upright edges of a column on a slab.
BLUNT, FILLET, WIDE_FILLET, COLUMN = 2.0, 3.0, 8.0, 6.0
# Radii of the holes of a drilled plate, and of the bore of a tube.
HOLE, BORE = 3.5, 8.0
# Radius of a rod, that of the circle of its bend, the length of its straight ends, and the bore of
# a pipe.
ROD, BEND, LEG, PIPE = 10.0, 30.0, 20.0, 7.0
# Cut of the edges of a bevelled box, along both faces.
BEVEL = 2.0


def _profile(name: str) -> np.ndarray:
    return np.array([corner.split(",") for corner in _PROFILES[name][0].split()], float)


STEP = _profile("step")


def _prism(name: str) -> trimesh.Trimesh:
    _, triangles, height = _PROFILES[name]
    faces = np.array([[int(corner, 12) for corner in triangle] for triangle in triangles.split()])
    return trimesh.creation.extrude_triangulation(_profile(name), faces, height=height)


def _ring(radius: float, height: float) -> np.ndarray:
    """(256, 3) points of a circle about the z-axis."""
    angle = np.arange(256) / 256 * 2.0 * np.pi
    return np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), np.full(len(angle), height)]
    )


def _filleted(radius: float) -> trimesh.Trimesh:
    """A step whose concave edge is rounded by 64 chords, 1e-4 radii within the circle."""
    angle = np.linspace(0.0, 0.5 * np.pi, 65)[:, None]
    centre = np.array([30.0 - radius, 20.0 + radius])
    arc = centre + radius * np.hstack([np.cos(angle), -np.sin(angle)])
    around = np.concatenate([STEP[:5], arc, STEP[6:]])
    following = np.roll(np.arange(len(around)), -1)
    fan = np.stack([np.full(len(around), len(around)), np.arange(len(around)), following], axis=1)
    # All of the profile is seen from the point in the taller block.
    profile = np.concatenate([around, [[45.0, 10.0]]])
    return trimesh.creation.extrude_triangulation(profile, fan, height=30.0)


def _columns(middles=(0.0,), slab: float = 30.0) -> trimesh.Trimesh:
    """Square columns with rounded upright edges, 32 wide and 20 high, amid squares of twice
    ``slab`` of a slab that is 15 high."""
    angle = np.linspace(-np.pi, np.pi, 4 * 64, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    inner = COLUMN * circle + (16.0 - COLUMN) * np.sign(circle + 1e-9)
    outer = slab * circle / np.abs(circle).max(axis=1)[:, None]
    # From the middle of the bottom up to that of the top: rings of as many points each.
    rings = [(0.0 * outer, 0.0), (outer, 0.0), (outer, 15.0), (inner, 15.0), (inner, 35.0)]
    rings.append((0.0 * inner, 35.0))
    count, points, faces = len(angle), [], []
    for middle in middles:
        first = sum(len(part) for part in points)
        points += [np.column_stack([r + (middle, 0.0), np.full(count, z)]) for r, z in rings]
        # Between two squares there is no side.
        apart = np.abs(middle + outer[:, 0]) > 1e-6
        for low in range(len(rings) - 1):
            a = first + low * count + np.arange(count)
            b = first + low * count + np.roll(np.arange(count), -1)
            kept = apart | np.roll(apart, -1) if low == 1 else np.ones(count, bool)
            faces.append(np.stack([a, b, a + count], axis=1)[kept])
            faces.append(np.stack([b, b + count, a + count], axis=1)[kept])
    mesh = trimesh.Trimesh(np.concatenate(points), np.concatenate(faces))
    mesh.merge_vertices()
    mesh.update_faces(mesh.nondegenerate_faces())
    return mesh


def _drilled() -> trimesh.Trimesh:
    """A plate of four by two squares of 24, 10 high, with a round hole amid six of them."""
    angle = np.linspace(-np.pi, np.pi, 64, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    square, count = 12.0 * circle / np.abs(circle).max(axis=1)[:, None], len(angle)
    on, following = np.arange(count), np.roll(np.arange(count), -1)
    points, faces = [], []
    for column, row in np.ndindex(4, 2):
        hole = HOLE if (column, row) not in ((1, 0), (2, 1)) else 0.0
        # The loops of the bottom and the top, and those of the hole.
        rings = [(square, 0.0), (hole * circle, 0.0), (hole * circle, 10.0), (square, 10.0)]
        bands = [(1, 0), (3, 2), *([(2, 1)] if hole else [])]
        first = sum(len(part) for part in points)
        middle = 24.0 * np.array([column, row])
        points += [np.column_stack([ring + middle, np.full(count, z)]) for ring, z in rings]
        border = np.abs(square + middle - (36.0, 12.0)) > np.array([48.0, 24.0]) - 1e-6
        outside = (border & border[following]).any(axis=1)
        for low, high in bands:
            a, b = first + low * count, first + high * count
            faces += [np.stack([a + on, a + following, b + on], axis=1)]
            faces += [np.stack([a + following, b + following, b + on], axis=1)]
        a, b = first, first + 3 * count
        faces += [np.stack([a + on, a + following, b + on], axis=1)[outside]]
        faces += [np.stack([a + following, b + following, b + on], axis=1)[outside]]
    mesh = trimesh.Trimesh(np.concatenate(points), np.concatenate(faces))
    mesh.merge_vertices()
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.fix_normals()
    return mesh


def _swept(offsets) -> trimesh.Trimesh:
    """The convex hull of a shape (k, 3) in each corner of a box."""
    corners = trimesh.creation.box(2.0 * (HALF - np.abs(offsets).max(axis=0))).vertices
    return trimesh.convex.convex_hull((corners[:, None] + offsets).reshape(-1, 3))


def _ellipsoid() -> trimesh.Trimesh:
    mesh = trimesh.creation.icosphere(5, 1.0)
    mesh.vertices *= HALF
    return mesh


def _egg() -> trimesh.Trimesh:
    """An ellipsoid whose sections across its longest axis are a fifth larger at one end and a fifth
    smaller at the other: a cubic surface."""
    mesh = _ellipsoid()
    mesh.vertices[:, 1:] *= 1.0 + 0.2 * mesh.vertices[:, :1] / HALF[0]
    return mesh


def _dome() -> trimesh.Trimesh:
    """The upper half of an ellipsoid, and a plane below it."""
    points = _ellipsoid().vertices
    return trimesh.convex.convex_hull(points[points[:, 2] > -1e-9])


def _cut_ball() -> trimesh.Trimesh:
    """A ball without the part above half of its radius."""
    ball, height = trimesh.creation.icosphere(4, RADIUS).vertices, 0.5 * RADIUS
    rim = _ring(np.sqrt(RADIUS**2 - height**2), height)
    return trimesh.convex.convex_hull(np.concatenate([ball[ball[:, 2] < height], rim]))


def _stadium() -> trimesh.Trimesh:
    """Two half cylinders of radius 15 and height 25, 40 apart, with planes between them."""
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 129)
    right = np.column_stack([20.0 + 15.0 * np.cos(angle), 15.0 * np.sin(angle)])
    around = np.concatenate([right, -right])
    ends = [np.column_stack([around, np.full(len(around), z)]) for z in (0.0, 25.0)]
    return trimesh.convex.convex_hull(np.concatenate(ends))


def _bend(bore: float = 0.0) -> trimesh.Trimesh:
    """A rod that is bent by a right angle, with straight ends, and with a bore a pipe."""
    turn = np.linspace(0.0, 0.5 * np.pi, 129)
    inward = np.column_stack([-np.cos(turn), 0.0 * turn, np.sin(turn)])
    inward = np.concatenate([inward[:1], inward, inward[-1:]])
    middles = BEND * inward
    middles[[0, -1]] += np.array([[0.0, 0.0, -LEG], [LEG, 0.0, 0.0]])
    around = _ring(1.0, 0.0)[::2, :2]
    radial = around[:, :1] * inward[:, None] + around[:, 1:] * np.array([0.0, 1.0, 0.0])
    # Along the outside, and back in the bore; without one, along the middles.
    rings = [middles[:, None] + ROD * radial, (middles[:, None] + bore * radial)[::-1]]
    points, count = np.concatenate(rings).reshape(-1, 3), len(around)
    on = np.arange(len(points))
    beside = on - on % count + (on + 1) % count
    ahead, both = np.roll(on, -count), np.roll(beside, -count)
    sides = [np.stack([on, beside, ahead], axis=1), np.stack([beside, both, ahead], axis=1)]
    mesh = trimesh.Trimesh(points, np.concatenate(sides))
    mesh.merge_vertices()
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.remove_unreferenced_vertices()
    mesh.fix_normals()
    return mesh


def _cup() -> trimesh.Trimesh:
    """A cup of radius 20 and height 40, with a wall of 4, a round lip, and a bottom that goes over
    into the wall by a radius of 8 outside and 4 inside, about one centre."""
    turn = np.linspace(0.0, 0.5 * np.pi, 33)[:, None]
    corner = np.array([12.0, 8.0]) + np.hstack([np.sin(turn), -np.cos(turn)])
    around = np.concatenate([2.0 * turn, 2.0 * turn[1:] + np.pi])
    lip = np.array([18.0, 40.0]) + 2.0 * np.hstack([np.cos(around), np.sin(around)])
    bottom = np.array([12.0, 8.0])
    parts = [[[0.0, 0.0]], bottom + 8.0 * (corner - bottom), lip[:33]]
    parts += [(bottom + 4.0 * (corner - bottom))[::-1], [[0.0, 4.0]]]
    return trimesh.creation.revolve(np.concatenate(parts), sections=256)


def _frustum(low: float, high: float) -> trimesh.Trimesh:
    """A cone of a height of 40 with radii at its bottom and top."""
    profile = np.array([[0.0, 0.0], [low, 0.0], [high, 40.0], [0.0, 40.0]])
    return trimesh.creation.revolve(profile, sections=256)


def _pyramid() -> trimesh.Trimesh:
    base = 25.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return trimesh.convex.convex_hull(np.concatenate([base, [[0.0, 0.0, 35.0]]]))


def _wavy_box() -> trimesh.Trimesh:
    """A box with waves of 4 on its top, and planes elsewhere."""
    mesh = trimesh.creation.box(2.0 * HALF)
    for _ in range(6):
        mesh = mesh.subdivide()
    x, y, z = mesh.vertices.T
    rise = 4.0 * np.sin(x / 9.0 + 0.5) * np.cos(y / 8.0 + 0.3)
    mesh.vertices[:, 2] += (0.5 + 0.5 * z / HALF[2]) * rise
    return mesh


_MESHES = {
    "box": lambda: trimesh.creation.box(2.0 * HALF),
    "plate": lambda: trimesh.creation.box(2.0 * PLATE),
    # Chords of so many sections lie 1.5e-3 within the circle, less than a tenth of the noise.
    "cylinder": lambda: trimesh.creation.cylinder(RADIUS, 2.0 * HALF_HEIGHT, sections=256),
    **{name: partial(_prism, name) for name in _PROFILES},
    "ellipsoid": _ellipsoid,
    "egg": _egg,
    "dome": _dome,
    "cut ball": _cut_ball,
    # Chords of an icosphere of four divisions lie 6e-4 radii within the ball.
    "rounded": lambda: _swept(trimesh.creation.icosphere(4, BLUNT).vertices),
    "bevelled": lambda: _swept(BEVEL * np.concatenate([np.eye(3), -np.eye(3)])),
    "filleted": lambda: _filleted(FILLET),
    "widely filleted": lambda: _filleted(WIDE_FILLET),
    "column": _columns,
    "two columns": lambda: _columns((-20.0, 20.0), 20.0),
    "drilled": _drilled,
    "tube": lambda: trimesh.creation.annulus(BORE, RADIUS, 2.0 * HALF_HEIGHT, sections=256),
    "stadium": _stadium,
    "bend": _bend,
    "pipe": lambda: _bend(PIPE),
    "cup": _cup,
    "frustum": lambda: _frustum(25.0, 15.0),
    "draft": lambda: _frustum(22.0, 20.0),
    "pyramid": _pyramid,
    "wavy": _wavy_box,
}


@lru_cache
def lawful_object(name: str) -> MeshObject:
    """A body of 1e-3 of its extent as its tolerance, and a fifth of that as noise."""
    mesh = _MESHES[name]()
    return MeshObject(name, np.array(mesh.vertices), np.array(mesh.faces))
