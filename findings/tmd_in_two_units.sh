#!/usr/bin/env bash
# Where two meet: .tmd files, the height maps of GelSight's touch sensors and of TrueMap, in surfalize
# and in SurfaceTopography.
#
# Common guess: two readers of surface texture give one height map one size, and area parameters that
# agree show that the units agree too.
# Versions: surfalize 0.19.2, SurfaceTopography 1.27.1 (Linux, Python 3.11).
# Behaviour: the format has no unit; GelSight's own toolbox for Matlab says millimetres, for lengths
# and for heights. SurfaceTopography says millimetres too. surfalize takes each number for micrometres,
# its own unit, so step and height are a thousandth of the true ones. As both are, slopes agree to
# all digits and nothing looks odd. Its writer does the same: a map of 4 µm that surfalize saves is one
# of 4 mm elsewhere. Both readers expect a comment of 24 bytes, and refuse a file whose comment is
# empty, which is what that toolbox writes.
# Output seen:
#   surfalize: 4.00 µm long, heights span 0.100 µm, root mean square slope 0.277
#   SurfaceTopography: 4000.00 µm long, heights span 100.000 µm, root mean square slope 0.277
#   saved by surfalize at 4 µm, read by SurfaceTopography: 4000.00 µm long
#   comment empty: refused by surfalize, refused by SurfaceTopography
# The script fails if that changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv v
v/bin/pip install --quiet surfalize==0.19.2 SurfaceTopography==1.27.1 numpy==2.4.6
cat > meet.py <<'PY'
import struct

import numpy as np
from SurfaceTopography import open_topography
from surfalize import Surface

ROWS, COLUMNS, STEP = 300, 400, 0.01


def write(path, comment):
    """Waves of 0.05 mm on 4 mm by 3 mm, in millimetres."""
    along = STEP * np.arange(COLUMNS)
    heights = np.tile(0.05 * np.sin(2 * np.pi * along / 0.8), (ROWS, 1))
    with open(path, "wb") as file:
        file.write(b"Binary TrueMap Data File v2.0\r\n\0" + comment + b"\0")
        file.write(struct.pack("<II4f", COLUMNS, ROWS, COLUMNS * STEP, ROWS * STEP, 0.0, 0.0))
        file.write(heights.astype("<f4").tobytes())


def of_surfalize(path):
    surface = Surface.load(path)
    return surface.size.x * surface.step_x, surface.Sz(), surface.Sdq()


def of_surface_topography(path):
    surface = open_topography(path).topography().to_unit("µm")
    return surface.physical_sizes[0], np.ptp(surface.heights()), surface.rms_gradient()


READERS = {"surfalize": of_surfalize, "SurfaceTopography": of_surface_topography}


def verdict(name, path):
    try:
        READERS[name](path)
    except Exception:
        return f"refused by {name}"
    return f"read by {name}"


write("part.tmd", b"Created by TrueMap v6\r\n")
for name, of in READERS.items():
    length, span, slope = of("part.tmd")
    print(
        f"{name}: {length:.2f} µm long, heights span {span:.3f} µm, "
        f"root mean square slope {slope:.3f}"
    )
Surface.load("part.tmd").save("saved.tmd")
length = of_surface_topography("saved.tmd")[0]
print(f"saved by surfalize at 4 µm, read by SurfaceTopography: {length:.2f} µm long")
write("empty.tmd", b"")
print("comment empty:", ", ".join(verdict(name, "empty.tmd") for name in READERS))
PY
v/bin/python meet.py | tee seen
diff seen - <<'SEEN'
surfalize: 4.00 µm long, heights span 0.100 µm, root mean square slope 0.277
SurfaceTopography: 4000.00 µm long, heights span 100.000 µm, root mean square slope 0.277
saved by surfalize at 4 µm, read by SurfaceTopography: 4000.00 µm long
comment empty: refused by surfalize, refused by SurfaceTopography
SEEN
