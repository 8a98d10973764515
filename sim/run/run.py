"""Run: a run folder as an object, for notebooks and scripts."""

import csv
import json
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from touchatlas.atlas import Atlas, Surface, Touch, load_atlas
from touchatlas.patch.words import count_of
from touchatlas.sim.folder.journal import Journal
from touchatlas.sim.folder.ply import read_ply
from touchatlas.sim.folder.run_folder import read_settings
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.judge.judgement import TEN, verdict
from touchatlas.sim.judge.number_meanings import COLUMNS
from touchatlas.sim.run.watcher import Watcher
from touchatlas.sim.world.objects import make_object

if TYPE_CHECKING:
    from k3d.plot import Plot


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """A run folder, read when it is asked for.

    Parameters
    ----------
    folder : Path
    settings : dict
        Those of run.toml.

    Examples
    --------
    ::

        run = load_run("runs/bottle-0")
        run.numbers["accuracy_p95"], run.steps["coverage"]
        run.plot()
    """

    folder: Path
    settings: dict[str, Any]

    @cached_property
    def numbers(self) -> dict[str, Any]:
        """Those of evaluation.json; none where the run was cut off before it was written."""
        try:
            found = json.loads((self.folder / "evaluation.json").read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        return dict(found)

    @cached_property
    def steps(self) -> dict[str, np.ndarray]:
        """The columns of steps.csv by their names, with an element for each touch: numbers, NaN
        where the file has none, and words of ``reason``. ``pandas.DataFrame(run.steps)`` is a
        table."""
        with open(self.folder / "steps.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        out = {name: np.array([float(row[name] or "nan") for row in rows]) for name in _NUMBERS}
        return {"touch": out.pop("touch"), "reason": np.array([r["reason"] for r in rows]), **out}

    @cached_property
    def touches(self) -> list[Touch]:
        """The touches of the journal, in order."""
        with closing(Journal(self.folder / "journal.sqlite")) as journal:
            return journal.touches()

    @cached_property
    def atlas(self) -> Atlas:
        """The atlas; another run folder or process has its own."""
        return load_atlas(self.folder / "atlas.npz")

    @cached_property
    def surface(self) -> Surface | None:
        """The surface of surface.ply, whose curvatures are not kept; None where there is none."""
        path = self.folder / "surface.ply"
        return read_ply(path) if path.is_file() else None

    def plot(self, colour: str = "deviation") -> "Plot":
        """The surface, contacts, contours and open places in three dimensions, for a notebook; the
        surface is coloured by its ``deviation``, up to the tolerance, or by ``face``.

        Returns
        -------
        k3d.plot.Plot
        """
        from touchatlas.atlas import scene

        unit = self.numbers.get("unit", "")
        plot, surface = scene.new_plot(unit if unit == "mm" else ""), self.surface
        met = [touch.contact for touch in self.touches if touch.contours]
        contacts = np.reshape(met, (-1, 3))
        size = 0.015 * float(np.linalg.norm(np.ptp(contacts, axis=0))) if len(contacts) else 1.0
        if surface is not None:
            scene.add_surface(plot, surface, colour, self.settings["tolerance"])
        curves = [contour.points for touch in self.touches for contour in touch.contours]
        scene.add_curves(plot, curves, 0.2 * size, "contours", scene.TRACKED)
        scene.add_points(plot, contacts, size, "contacts", scene.TOUCHED)
        places = np.reshape(self.numbers.get("open_places") or [], (-1, 3))
        scene.add_points(plot, places, size, "open places", scene.OPEN)
        return plot

    def __repr__(self) -> str:
        """One line: what was explored, and what came of it."""
        numbers = self.numbers
        if not numbers:
            return f"<Run: {self.folder}, not finished>"
        words = f"{count_of(numbers['touches'], 'touch')}, "
        words += f"{count_of(numbers['faces'], 'face')}, "
        words += f"{numbers['predicted_coverage']:.1%} known to the tolerance"
        if diameter := numbers.get("free_disc"):
            words += f", holes and horns up to {diameter:.3g} may be missed"
        return f"<Run: {self.folder}, {words}, ended: {numbers['ended']}>"

    def _repr_html_(self) -> str:
        """The verdict and ten numbers."""
        rows = [
            f"<tr><td>{name}</td><td>{self.numbers[name]:.4g}</td></tr>"
            for name in TEN
            if isinstance(self.numbers.get(name), int | float)
        ]
        words = escape(verdict(self.numbers) or "")
        return f"<div>{escape(repr(self)[1:-1])}</div><p>{words}</p><table>{''.join(rows)}</table>"


_NUMBERS = [name for name in COLUMNS if name != "reason"]


def load_run(folder) -> Run:
    """The run that a folder holds.

    Raises
    ------
    ValueError
        When it holds none.
    """
    return Run(Path(folder), read_settings(folder))


def explore(
    name: str,
    out=None,
    options: RunOptions = RunOptions(),
    force: bool = False,
    progress: Callable[[int, float], None] | None = None,
) -> Run:
    """Explore a simulated object, as the command of this name does, and give its run.

    Parameters
    ----------
    name : str
        A built-in name (see ``object_names``) or the path of a mesh file.
    out : path, optional
        Folder for the run; as that of the command by default.
    options : RunOptions
    force : bool
        Replace the run that the folder holds, when the new one is whole.
    progress : function of the number of touches and the share known, optional
        Called after each touch; a bar that is drawn over itself by default.
    """
    from touchatlas.sim.folder.out_folder import default_folder
    from touchatlas.sim.run.exploration import run_exploration

    obj = make_object(name, options.seed)
    out = default_folder(obj.name, options) if out is None else out
    result = run_exploration(obj, out, options, force, _Callback(progress or _line))
    if progress is None:
        print()
    return load_run(result.folder)


def _line(touches: int, known: float) -> None:
    """Draw how far a run is, over what was drawn before."""
    bar = "#" * round(24 * known)
    words = f"{count_of(touches, 'touch')}, {known:.1%} known to the tolerance"
    print(f"\r[{bar:<24}] {words}", end="", flush=True)


class _Callback(Watcher):
    """A watcher that calls a function after each touch."""

    def __init__(self, progress: Callable[[int, float], None]) -> None:
        self._progress = progress

    def touched(self, step, atlas) -> None:
        """A touch was learned."""
        self._progress(step.plan.number + 1, step.plan.known)
