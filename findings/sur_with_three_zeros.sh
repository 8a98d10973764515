#!/usr/bin/env bash
# Where three meet: height maps in Digital Surf's .sur, of surfalize, RosettaSciIO and
# SurfaceTopography.
#
# Common guess: heights in one unit that survive a round trip through a .sur file are the same numbers
# in any other reader of the format; so two pads mapped in one frame keep the step between them.
# Versions: surfalize 0.19.2, rosettasciio 0.15.0, SurfaceTopography 1.27.1 (Linux, Python 3.11).
# Behaviour: a file holds whole numbers from Zmin up, a spacing and an offset of Z. surfalize reads
# number * spacing + offset, RosettaSciIO (number - Zmin) * spacing + offset, and SurfaceTopography
# number * spacing. The first two write what they read, with numbers on both sides of nought. So each
# shifts the other's maps by half of their own span, and the third loses where a map lay. A step of
# 100 µm between pads with spans of 1 and 9 µm is wrong by half the difference of the spans, 4 µm,
# or is gone. Spans, slopes and roughness agree, and nothing warns.
# Output seen:
#   step as written: 100.000 µm
#   written by surfalize: surfalize 100.000, RosettaSciIO 104.000, SurfaceTopography -4.000
#   written by RosettaSciIO: surfalize 96.000, RosettaSciIO 100.000, SurfaceTopography -4.000
#   span of the upper pad in all 6: 9.000 to 9.000 µm
# The script fails if that changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv v
v/bin/pip install --quiet surfalize==0.19.2 rosettasciio==0.15.0 SurfaceTopography==1.27.1 \
    numpy==2.4.6
cat > meet.py <<'PY'
import numpy as np
from rsciio import digitalsurf
from SurfaceTopography import open_topography
from surfalize import Surface

STEP = 0.5


def pad(lowest, span):
    """A ramp of a given span, in micrometres."""
    return lowest + np.tile(np.linspace(0.0, span, 60), (40, 1))


def write_by_surfalize(path, heights):
    Surface(heights, STEP, STEP).save(path)


def write_by_rosettasciio(path, heights):
    axes = [
        {
            "name": name,
            "size": size,
            "index_in_array": index,
            "scale": STEP,
            "offset": 0.0,
            "units": "um",
            "navigate": False,
        }
        for index, (name, size) in enumerate(zip("YX", heights.shape, strict=True))
    ]
    kind = {"General": {}, "Signal": {"quantity": "Height (um)"}}
    signal = {"data": heights, "axes": axes, "metadata": kind, "original_metadata": {}}
    digitalsurf.file_writer(path, signal, compressed=False)


WRITERS = {"surfalize": write_by_surfalize, "RosettaSciIO": write_by_rosettasciio}
READERS = {
    "surfalize": lambda path: Surface.load(path).data,
    "RosettaSciIO": lambda path: digitalsurf.file_reader(path)[0]["data"],
    "SurfaceTopography": lambda path: open_topography(path).topography().heights(),
}

lower, upper = pad(0.0, 1.0), pad(100.0, 9.0)
print(f"step as written: {upper.min() - lower.min():.3f} µm")
spans = []
for writer, write in WRITERS.items():
    write("lower.sur", lower)
    write("upper.sur", upper)
    steps = {
        name: np.min(read("upper.sur")) - np.min(read("lower.sur"))
        for name, read in READERS.items()
    }
    spans += [np.ptp(read("upper.sur")) for read in READERS.values()]
    print(f"written by {writer}:", ", ".join(f"{name} {step:.3f}" for name, step in steps.items()))
print(f"span of the upper pad in all {len(spans)}: {min(spans):.3f} to {max(spans):.3f} µm")
PY
v/bin/python meet.py | tee seen
diff seen - <<'SEEN'
step as written: 100.000 µm
written by surfalize: surfalize 100.000, RosettaSciIO 104.000, SurfaceTopography -4.000
written by RosettaSciIO: surfalize 96.000, RosettaSciIO 100.000, SurfaceTopography -4.000
span of the upper pad in all 6: 9.000 to 9.000 µm
SEEN
