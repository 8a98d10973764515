"""FrameStore: what was known when each plan was made, kept from one call to the next.

Its pictures are no state of a run: a store that cannot be read is begun anew.
"""

import io
import json
import sqlite3
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from touchatlas.atlas import Scan, Touch
from touchatlas.atlas.body.body import Body
from touchatlas.planner import ProbePlan
from touchatlas.planner.places import Places
from touchatlas.sim.folder.plan_files import plan_as_dict, plan_of_dict
from touchatlas.sim.look.frames import Frames, Mesh, mesh_of, thinned
from touchatlas.sim.look.words import sought

_SCHEMA = "create table if not exists frame (plan integer primary key, words text, arrays blob);"
_MESH = "vertices", "faces", "deviation", "face", "patch"


class FrameStore:
    """Frames in an SQLite file: a row for each plan, with its words and the surface before it."""

    def __init__(self, path: Path) -> None:
        self._database = sqlite3.connect(path)
        try:
            self._database.execute(_SCHEMA)
        except sqlite3.DatabaseError:
            self._database.close()
            path.unlink()
            self._database = sqlite3.connect(path)
            self._database.execute(_SCHEMA)

    def keep(self, plan: ProbePlan, places: Places | None, body: Body | None, apart: float) -> None:
        """Keep a plan, the surface and open places by which it was made, and the patches of their
        body; of the places those farther from each other than ``apart``, length."""
        arrays = {"rim": np.zeros((0, 3))}
        if places is not None and len(places.rim):
            arrays["rim"] = thinned(places.rim, apart)
        if places is not None and places.surface is not None:
            mesh = mesh_of(places.surface, plan.number, body)
            arrays |= {name: getattr(mesh, name) for name in _MESH}
        file = io.BytesIO()
        np.savez_compressed(file, allow_pickle=False, **arrays)
        row = plan.number, json.dumps(plan_as_dict(plan)), file.getvalue()
        with self._database:
            self._database.execute("insert or replace into frame values (?, ?, ?)", row)

    def frames(self, touches: Sequence[Touch], scans: Sequence[Scan]) -> Frames:
        """The frames of touches, after scans."""
        frames = Frames(scans=[curve for scan in scans for curve in _curves(scan)])
        for place, touch in enumerate(touches):
            query = "select words, arrays from frame where plan = ?"
            row = self._database.execute(query, (touch.number,)).fetchone()
            if row is None:
                continue
            plan = plan_of_dict(json.loads(row[0]))
            with np.load(io.BytesIO(row[1]), allow_pickle=False) as held:
                arrays = {name: held[name] for name in held.files}
            if "vertices" in arrays:
                frames.meshes.append(Mesh(place, *(arrays[name] for name in _MESH)))
            frames.plans.append(plan)
            frames.touches.append(touch)
            frames.words.append(f"{sought(plan)}; {plan.known:.1%} known")
            frames.open_places.append(arrays["rim"])
        return frames

    def close(self) -> None:
        """Close the file."""
        self._database.close()


def _curves(scan: Scan) -> list[np.ndarray]:
    """The curves of a scan, (n, 3) each, and none of its other points."""
    if scan.curves is None:
        return []
    return [scan.points[scan.curves == k] for k in np.unique(scan.curves[scan.curves >= 0])]
