"""Files of a run that learns from files: the finished atlas, its surface, doubts and pictures."""

import json
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import igl

from touchatlas.atlas import Atlas, Surface, doubts, extract_surface, load_atlas, save_atlas
from touchatlas.atlas.check.doubt import ended_early
from touchatlas.atlas.check.faults import faults
from touchatlas.atlas.check.free_disc import disc_numbers, feature_doubts
from touchatlas.atlas.files import write_whole
from touchatlas.planner import Planner, StopReason
from touchatlas.planner.region import region_doubts
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.ply import ply_bytes, stored
from touchatlas.sim.judge.surface_picture import deviation_picture
from touchatlas.sim.look.curves import chart
from touchatlas.sim.look.replay import replay_bytes
from touchatlas.sim.run.learning_run import RECORDED, LearningRun
from touchatlas.sim.run.watcher import Watcher


@dataclass(frozen=True, eq=False)
class Learned:
    """What a call came to.

    Parameters
    ----------
    folder : Path
    numbers : dict
        Those of evaluation.json; none where nothing was drawn.
    surface : Surface or None
    refused : list of str
        Why scans or touches taught nothing.
    """

    folder: Path
    numbers: dict
    surface: Surface | None
    refused: list[str]

    def moved(self, folder: Path) -> "Learned":
        """The same in another folder."""
        return replace(self, folder=folder)


def write_files(run: LearningRun, watcher: Watcher, refused: list[str]) -> Learned:
    """Write the finished atlas of a run, its surface, doubts and pictures. The run itself goes on
    from the atlas as it is."""
    folder = run.folder
    atlas = load_atlas(folder / "atlas.npz", finished=False)
    watcher.begins("finishing the atlas")
    atlas.finish()
    save_atlas(folder / "atlas.npz", atlas)
    watcher.begins("extracting the surface")
    surface = stored(extract_surface(atlas), atlas.tolerance) if len(atlas) else None
    numbers = _numbers(run.planner, atlas, surface, run.settings.get("unit", ""))
    if surface is not None:
        write_whole(folder / "surface.ply", ply_bytes(surface, atlas.tolerance))
        _write_step(folder, atlas)
    watcher.begins("drawing the pictures")
    if surface is not None and len(surface.faces):
        body = surface.vertices, surface.faces
        picture = deviation_picture(
            "the surface, and how sure it is", body, surface.deviation, atlas.tolerance
        )
        write_whole(folder / "surface.png", picture)
        write_whole(folder / "replay.html", _replay(run, atlas, surface, numbers["open_places"]))
    write_whole(folder / "evaluation.json", (json.dumps(numbers, indent=2) + "\n").encode())
    return Learned(folder, numbers, surface, refused)


def _numbers(planner: Planner, atlas: Atlas, surface: Surface | None, unit: str) -> dict[str, Any]:
    """Numbers of the atlas, without a truth."""
    forecast, stop = planner.forecast(atlas), planner.stop
    ended = "" if stop is None else stop.reason.value
    share, places = forecast.predicted_coverage, forecast.open_places
    is_early = stop is not None and stop.reason is not StopReason.KNOWN
    words = ended_early(ended, share) if is_early else ""
    body = atlas.body
    numbers = {
        "tolerance": atlas.tolerance,
        "unit": unit or "unit of the files",
        "noise_std": float(atlas.pool.noise.min()) if len(atlas.pool) else None,
        "predicted_coverage": share,
        "open_places": places.tolist(),
        "watertight": _is_closed(surface),
        "touches": atlas.touches,
        "points": atlas.point_count,
        "patches": len(atlas),
        "faces": 0 if body is None else len(body.faces),
        "diagonal": atlas.pool.extent,
        **disc_numbers(planner.free_disc(atlas)),
        "feature": planner.options.feature,
        "region": planner.options.region,
    }
    empty = region_doubts(numbers["region"], atlas.without_tip.pool.points) if ended else []
    found = *empty, *feature_doubts(numbers), *doubts(atlas, surface, places, words)
    numbers["faults"] = [fault.as_dict() for fault in faults(atlas)]
    numbers["doubts"] = [doubt.as_dict() for doubt in found]
    return numbers | ({"ended": ended} if ended else {})


def _replay(run: LearningRun, atlas: Atlas, surface: Surface, open_places) -> bytes:
    """replay.html: what was scanned, what each touch added, and the surface."""
    with closing(Journal(run.journal)) as journal:
        touches, scans = journal.touches(), [scan for _, scan in journal.scans()]
    with closing(run.frames) as store:
        frames = store.frames(touches, scans)
    frames.end(surface, open_places, atlas.body)
    known: dict[str, list[float | None]] = {"predicted": [plan.known for plan in frames.plans]}
    length: dict[str, list[float | None]] = {
        "in contact": [touch.tracked_length for touch in touches],
        "in the air": [touch.travel_length for touch in touches],
    }
    unit = run.settings.get("unit", "")
    curves = chart("Known to the tolerance", known, top=1.0) if touches else ""
    curves += chart("Path of the probe", length, unit) if touches else ""
    body = atlas.without_tip.body
    faces = [face.words for face in body.faces.faces] if body else []
    return replay_bytes(RECORDED, frames, atlas.tolerance, unit, None, None, curves, faces)


def _is_closed(surface: Surface | None) -> bool:
    """Whether a surface has triangles and no rim."""
    if surface is None or not len(surface.faces):
        return False
    return not len(igl.boundary_facets(surface.faces)[0])


def _write_step(folder: Path, atlas: Atlas) -> None:
    """Write surface.step, where the CAD kernel is installed."""
    try:
        from touchatlas.atlas import save_step

        save_step(atlas, folder / "surface.step")
    except (ImportError, ValueError):
        # Without the extra cad, and of a surface without triangles, there is none.
        (folder / "surface.step").unlink(missing_ok=True)
