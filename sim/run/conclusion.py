"""The end of a run: the atlas finished, its surface, the judge's numbers, pictures, files."""

import json
from dataclasses import dataclass, field, fields
from pathlib import Path

import numpy as np

from touchatlas.atlas import Atlas, Surface, doubts, extract_surface, save_atlas
from touchatlas.atlas.check.doubt import ended_early
from touchatlas.atlas.check.faults import faults
from touchatlas.atlas.check.free_disc import feature_doubts
from touchatlas.atlas.files import write_whole
from touchatlas.planner import StopReason
from touchatlas.planner.region import region_doubts
from touchatlas.sim.folder.ply import ply_bytes, stored
from touchatlas.sim.folder.run_options import check_number
from touchatlas.sim.judge.evaluate import Evaluation, evaluate_surface
from touchatlas.sim.judge.judgement import is_met, truth_warnings
from touchatlas.sim.judge.number_meanings import LENGTH
from touchatlas.sim.judge.surface_picture import surface_picture
from touchatlas.sim.judge.truth import EvaluateOptions, Truth
from touchatlas.sim.look.frames import Frames
from touchatlas.sim.look.replay import replay_bytes
from touchatlas.sim.run.phases import Phases
from touchatlas.sim.run.progress import SECONDS, Progress
from touchatlas.sim.world.implicit_object import ImplicitObject
from touchatlas.sim.world.mesh_object import MeshObject

# Truth triangles may be off the true surface by this fraction of the tolerance. Twice as much
# halves the number of triangles and adds 1 % of the tolerance to the measured errors.
_TRUTH_SAGITTA = 0.01
# Phases whose seconds stand in evaluation.json beside those of steps.csv.
_PHASES = ("start", "repeat", "record", "finish", "surface", "evaluate", "files")


def truth_of(obj, tolerance: float, rng, options: EvaluateOptions = EvaluateOptions()) -> Truth:
    """The object as the judge sees it."""
    check_number("tolerance", tolerance)
    points, normals = obj.sample(options.samples, rng)
    vertices, faces = obj.mesh(_TRUTH_SAGITTA * tolerance)
    return Truth(vertices, faces, points, normals, obj.closed, obj.euler_characteristic)


def unit_of(obj: ImplicitObject | MeshObject) -> str:
    """The unit of an object's lengths: millimetres of a built-in one, the file's own of a mesh."""
    return "mm" if isinstance(obj, ImplicitObject) else obj.unit or LENGTH


@dataclass
class Conclusion:
    """What an exploration came to.

    Parameters
    ----------
    obj : ImplicitObject or MeshObject
    atlas : Atlas
    progress : Progress
    phases : Phases
    seconds_before : float, s
        Of an earlier process, as far as they are known.
    frames : Frames
        What was known touch by touch.
    """

    obj: ImplicitObject | MeshObject
    atlas: Atlas
    progress: Progress
    phases: Phases
    seconds_before: float = 0.0
    frames: Frames = field(default_factory=Frames)

    def write(self, folder: Path, rng, known: dict) -> tuple[Surface | None, dict]:
        """Surface and numbers, with the files of both; ``known`` are numbers of the caller.

        evaluation.json is written last: where it agrees with the journal, the run is whole.
        """
        atlas, phases = self.atlas, self.phases
        with phases("files", "saving the atlas"):
            # Before it is finished, too: if that is cut short, this is there.
            save_atlas(folder / "atlas.npz", atlas)
        with phases("finish", "finishing the atlas"):
            atlas.finish()
        with phases("files", "saving the atlas"):
            save_atlas(folder / "atlas.npz", atlas)
        with phases("surface", "extracting the surface"):
            surface = stored(extract_surface(atlas), atlas.tolerance) if len(atlas) else None
        if surface is not None:
            with phases("files", "writing the surface"):
                write_whole(folder / "surface.ply", ply_bytes(surface, atlas.tolerance))
        with phases("evaluate", "comparing the surface with the truth"):
            truth = None
            if surface is not None and len(surface.faces):
                truth = truth_of(self.obj, atlas.tolerance, rng)
            numbers = self._quality(surface, truth, rng)
            numbers["doubts"] = self._doubts(surface, known)
            numbers["faults"] = [fault.as_dict() for fault in faults(atlas)]
        with phases("files", "drawing the pictures"):
            self._draw(folder, surface, truth, known["open_places"])
        numbers |= known | self._expense() | self._seconds()
        write_whole(folder / "evaluation.json", (json.dumps(numbers, indent=2) + "\n").encode())
        return surface, numbers

    def _doubts(self, surface: Surface | None, known: dict) -> list[dict]:
        """What speaks against the surface, ready for JSON."""
        stopped, places = "", ()
        if known["ended"] != StopReason.KNOWN.value:
            share, places = known["predicted_coverage"], known["open_places"]
            stopped = ended_early(known["ended"], share)
        found = doubts(self.atlas, surface, places, stopped, known["unreachable_places"])
        empty = region_doubts(known["region"], self.atlas.without_tip.pool.points)
        return [doubt.as_dict() for doubt in (*empty, *feature_doubts(known), *found)]

    def _draw(
        self, folder: Path, surface: Surface | None, truth: Truth | None, open_places
    ) -> None:
        """Write progress.png, surface.png and replay.html."""
        name, tolerance, unit = self.obj.name, self.atlas.tolerance, unit_of(self.obj)
        if self.progress.rows:
            write_whole(folder / "progress.png", self.progress.png_bytes(name, unit))
        if surface is not None and truth is not None:
            self.frames.end(surface, open_places, self.atlas.body)
            bare = self.atlas.without_tip.body
            faces = [face.words for face in bare.faces.faces] if bare else []
            curves, closest, seen = self.progress.charts(unit), truth.closest, self._seen()
            own = tolerance, unit, closest, seen, curves, faces
            page = replay_bytes(name, self.frames, *own)
            write_whole(folder / "replay.html", page)
            error, _, _ = closest(surface.vertices)
            body = surface.vertices, surface.faces
            picture = surface_picture(name, body, error, seen, tolerance, unit)
            write_whole(folder / "surface.png", picture)

    def _seen(self) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (v, 3) and faces (f, 3) of the object as fine as a picture shows it: those that
        its points are drawn from."""
        return self.obj.mesh(0.5 * self.obj.tolerance)

    def _quality(self, surface: Surface | None, truth: Truth | None, rng) -> dict:
        """How good the surface is; without a surface the numbers are None or zero."""
        obj, atlas = self.obj, self.atlas
        numbers: dict = dict.fromkeys(field.name for field in fields(Evaluation))
        numbers |= {"coverage": 0.0, "f_score": 0.0, "watertight": False}
        numbers["true_euler_characteristic"] = obj.euler_characteristic if obj.closed else None
        numbers |= {"total_curvature_over_2pi": None, "diagonal": obj.diagonal}
        numbers["closed_holes"] = 0 if surface is None else len(surface.closed_holes)
        numbers["stray_pieces"] = 0 if surface is None else surface.stray_pieces
        if surface is not None and truth is not None:
            evaluation = evaluate_surface(
                surface.vertices,
                surface.faces,
                truth,
                atlas.tolerance,
                rng,
                surface.deviation,
            )
            numbers |= evaluation.as_dict()
            numbers["total_curvature_over_2pi"] = surface.total_curvature() / (2.0 * np.pi)
        numbers |= {"tolerance": atlas.tolerance, "unit": unit_of(obj)}
        return numbers | {"met": is_met(numbers), "warnings": truth_warnings(numbers)}

    def _expense(self) -> dict:
        """Numbers of touches, samples and patches, and lengths."""
        atlas, progress = self.atlas, self.progress
        return {
            "touches": len(progress.rows),
            "touches_without_contact": progress.not_touched,
            "contours": progress.sum("contours"),
            "points": atlas.point_count,
            "patches": len(atlas),
            "faces": 0 if atlas.body is None else len(atlas.body.faces),
            "tracked_length": progress.last("tracked_length"),
            "travel_length": progress.last("travel_length"),
        }

    def _seconds(self) -> dict:
        """Seconds of all parts, and their sum, which is the time that the run took."""
        parts = {name: self.progress.sum(name) for name in SECONDS}
        parts |= {f"seconds_{name}": self.phases.seconds.get(name, 0.0) for name in _PHASES}
        return parts | {"seconds_total": self.seconds_before + self.phases.elapsed()}
