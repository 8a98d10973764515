#!/usr/bin/env bash
# Where two meet: a mesh in metres of easting and northing, and the fast winding numbers of libigl.
#
# Common guess: which side of a mesh a point is on does not change where mesh and points are moved
# together. Arrays are in double precision, in which a northing is known to a nanometre.
# Version: libigl 2.6.3 (Python package, Linux, Python 3.11).
# Behaviour: fast_winding_number takes points that are a hundredth of the radius inside or outside of
# a ball to the wrong side where the ball lies in a zone of UTM: a tenth of them for a dome of 12 m,
# four in ten for a radius of 1.2 m. winding_number has all of them right, and so has the fast one
# where places are taken from the middle of the mesh. Nothing warns.
# Output seen:
#   radius 120 m, of 2000 points on the wrong side: fast 0, exact 0, fast about the middle 0
#   radius 12 m, of 2000 points on the wrong side: fast 225, exact 0, fast about the middle 0
#   radius 1.2 m, of 2000 points on the wrong side: fast 844, exact 0, fast about the middle 0
# The script fails if that changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv v
v/bin/pip install --quiet libigl==2.6.3 numpy==2.4.6
cat > sides.py <<'PY'
import igl
import numpy as np

# Easting, northing and height in a zone of UTM, in metres.
PLACE = np.array([500000.0, 5400000.0, 100.0])


def ball(rings=60, sectors=120):
    """Triangles of a closed ball of radius 12 without seams."""
    height, turn = np.meshgrid(
        np.linspace(0.0, np.pi, rings + 2)[1:-1],
        np.linspace(0.0, 2.0 * np.pi, sectors, endpoint=False),
    )
    points = np.stack(
        [np.sin(height) * np.cos(turn), np.sin(height) * np.sin(turn), np.cos(height)], axis=-1
    ).reshape(-1, 3)
    number = np.arange(rings * sectors).reshape(sectors, rings)
    after = np.roll(number, -1, axis=0)
    a, b, c, d = number[:, :-1], number[:, 1:], after[:, :-1], after[:, 1:]
    top, bottom = np.full(sectors, len(points)), np.full(sectors, len(points) + 1)
    faces = [np.stack(part, axis=-1).reshape(-1, 3) for part in ((a, b, c), (b, d, c))]
    faces.append(np.stack([top, number[:, 0], after[:, 0]], axis=1))
    faces.append(np.stack([bottom, after[:, -1], number[:, -1]], axis=1))
    return 12.0 * np.vstack([points, [[0, 0, 1], [0, 0, -1]]]), np.concatenate(faces)


rng = np.random.default_rng(0)
vertices, faces = ball()
direction = rng.normal(size=(2000, 3))
direction /= np.linalg.norm(direction, axis=1)[:, None]
inside = rng.random(2000) < 0.5
points = 12.0 * np.where(inside, 0.99, 1.01)[:, None] * direction
for radius in (120.0, 12.0, 1.2):
    moved, at = radius / 12.0 * vertices + PLACE, radius / 12.0 * points + PLACE
    middle = moved.mean(axis=0)
    found = {
        "fast": igl.fast_winding_number(moved, faces, at),
        "exact": igl.winding_number(moved, faces, at),
        "fast about the middle": igl.fast_winding_number(moved - middle, faces, at - middle),
    }
    words = ", ".join(f"{name} {int(((n > 0.5) != inside).sum())}" for name, n in found.items())
    print(f"radius {radius:g} m, of 2000 points on the wrong side: {words}")
PY
v/bin/python sides.py | tee seen
diff seen - <<'SEEN'
radius 120 m, of 2000 points on the wrong side: fast 0, exact 0, fast about the middle 0
radius 12 m, of 2000 points on the wrong side: fast 225, exact 0, fast about the middle 0
radius 1.2 m, of 2000 points on the wrong side: fast 844, exact 0, fast about the middle 0
SEEN
