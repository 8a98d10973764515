#!/usr/bin/env bash
# Where two meet: a mesh in metres, as robots have them, and the rays of libigl.
#
# Common guess: a ray meets the same triangles of a mesh in metres as of the same mesh in millimetres;
# distances of points do, and the arrays are in double precision.
# Version: libigl 2.6.3 (Python package, Linux, Python 3.11).
# Behaviour: rays of AABB.intersect_ray_first and of ray_mesh_intersect with directions of length one
# pass through each triangle whose two edges span less than a millionth of the square of the unit: a
# ball of 24 mm in metres, of triangles of a third of a square millimetre, has no hit at all, and
# nothing warns. A direction a thousand times as long meets the very same triangles. Where a ray
# meets a triangle is rounded to single precision. Distances of points from the same tree are right
# in either unit.
# Output seen:
#   in mm: rays met 1000 of 1000, those of length 1000 met 1000; points are 2.00 radii away
#   in m: rays met 0 of 1000, those of length 1000 met 1000; points are 2.00 radii away
#   legs of 1.1 mm in metres: met
#   legs of 0.9 mm in metres: not met
# The script fails if that changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv v
v/bin/pip install --quiet libigl==2.6.3 numpy==2.4.6
cat > meet.py <<'PY'
import igl
import numpy as np


def ball(radius, rings=48, sectors=96):
    """Triangles of a ball without its poles."""
    height, turn = np.meshgrid(
        np.linspace(0.1, np.pi - 0.1, rings), np.linspace(0, 2 * np.pi, sectors, endpoint=False)
    )
    points = np.stack(
        [np.sin(height) * np.cos(turn), np.sin(height) * np.sin(turn), np.cos(height)], axis=-1
    )
    number = np.arange(rings * sectors).reshape(sectors, rings)
    a, b = number[:, :-1].ravel(), number[:, 1:].ravel()
    after = np.roll(number, -1, axis=0)
    c, d = after[:, :-1].ravel(), after[:, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])
    return radius * points.reshape(-1, 3), faces


rng = np.random.default_rng(0)
toward = np.column_stack([rng.normal(size=(1000, 2)), np.zeros(1000)])
toward /= np.linalg.norm(toward, axis=1)[:, None]
for unit, radius in (("mm", 12.0), ("m", 0.012)):
    vertices, faces = ball(radius)
    tree = igl.AABB()
    tree.init(vertices, faces)
    eyes = 3.0 * radius * toward
    met = [
        int(np.isfinite(tree.intersect_ray_first(vertices, faces, eyes, -length * toward)[1]).sum())
        for length in (1.0, 1000.0)
    ]
    away = np.sqrt(tree.squared_distance(vertices, faces, eyes)[0]).mean() / radius
    print(
        f"in {unit}: rays met {met[0]} of 1000, those of length 1000 met {met[1]}; "
        f"points are {away:.2f} radii away"
    )
for leg in (1.1e-3, 0.9e-3):
    vertices = np.array([[0.0, 0, 0], [leg, 0, 0], [0, leg, 0]])
    above, down = np.array([leg / 4, leg / 4, 1.0]), np.array([0.0, 0, -1])
    met = igl.ray_mesh_intersect(above, down, vertices, np.array([[0, 1, 2]]))
    print(f"legs of {1e3 * leg:.1f} mm in metres: {'met' if met else 'not met'}")
PY
v/bin/python meet.py | tee seen
diff seen - <<'SEEN'
in mm: rays met 1000 of 1000, those of length 1000 met 1000; points are 2.00 radii away
in m: rays met 0 of 1000, those of length 1000 met 1000; points are 2.00 radii away
legs of 1.1 mm in metres: met
legs of 0.9 mm in metres: not met
SEEN
