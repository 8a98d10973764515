"""What is claimed of an object of which one half was touched: how much of it is false.

An exploration is cut short of its touches that were made on the far side of the middle, and the
atlas of the others gives its surface. False is what lies farther than three tolerances from the
truth, as a fraction of the area of the surface.

    python examples/half_touched.py [OBJECT ...]

OBJECT is built in, or a mesh in the folder TOUCHATLAS_OBJECTS, of 400 touches at most.
"""

import os
import sys
from pathlib import Path

import numpy as np

from touchatlas.atlas import Atlas, extract_surface
from touchatlas.planner import Planner, explore
from touchatlas.sim import Probe, make_object, object_names
from touchatlas.sim.study.surface_peers import distances
from touchatlas.sim.world.triangles import areas_of

FOLDER = os.environ.get("TOUCHATLAS_OBJECTS", Path(__file__).parents[2] / "shared" / "objects")
NOISE, MOST_TOUCHES = 2e-4, 400


def half_of(obj, rng) -> Atlas:
    """The atlas of the touches on one half of an object, cut across its longest side."""
    probe = Probe(obj, NOISE * obj.diagonal, rng)
    most = None if obj.name in object_names() else MOST_TOUCHES
    planner = Planner(*obj.start())
    touches = [s.touch for s in explore(Atlas(obj.tolerance), planner, probe, most)]
    low, high = obj.bounds
    side = int((high - low).argmax())
    half = Atlas(obj.tolerance)
    for touch in touches:
        if touch.contact[side] > 0.5 * (low + high)[side]:
            half.add(touch)
    half.finish()
    return half


def main(*names) -> None:
    print("| object | patches | fraction of the area | false fraction | mean / tolerance |")
    print("|---|---|---|---|---|")
    for name in names or ("sphere",):
        obj = make_object(name if name in object_names() else f"{Path(FOLDER, name)}.ply")
        atlas = half_of(obj, np.random.default_rng(0))
        surface = extract_surface(atlas)
        areas = areas_of(surface.vertices, surface.faces)
        centres = surface.vertices[surface.faces].mean(axis=1)
        off = distances(*obj.mesh(0.05 * obj.tolerance), centres) / obj.tolerance
        false, mean = areas @ (off > 3.0) / areas.sum(), areas @ off / areas.sum()
        fraction = areas.sum() / obj.area
        print(f"| {name} | {len(atlas)} | {fraction:.3f} | {false:.5f} | {mean:.4f} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
