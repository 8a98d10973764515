"""Runs side by side: their options, their numbers, and curves of error against cost."""

import csv
import io
import json
import os
from dataclasses import dataclass
from pathlib import Path

from touchatlas.atlas.files import write_whole
from touchatlas.sim.folder.option_tables import flattened
from touchatlas.sim.folder.out_folder import make_out_folder
from touchatlas.sim.folder.run_folder import check_explored, going_on, read_settings
from touchatlas.sim.judge.mismatches import mismatches_of
from touchatlas.sim.judge.number_meanings import LENGTH, NUMBERS
from touchatlas.sim.look.canvas import canvas, png_of

FILES = ("compare.csv", "compare.png")
# Numbers that are printed, of those in evaluation.json.
_PRINTED = (
    "ended",
    "coverage",
    "accuracy_mean",
    "accuracy_p95",
    "completeness_mean",
    "completeness_p95",
    "normal_error_deg_mean",
    "deviation_calibration",
    "watertight",
    "euler_characteristic",
    "touches",
    "tracked_length",
    "travel_length",
    "faces",
    "patches",
    "seconds_total",
)


@dataclass(frozen=True)
class Comparison:
    """Numbers of runs, and the steps of each.

    Parameters
    ----------
    names : tuple of str
        Of the runs.
    differing : dict
        Options in which the runs differ, each with a value for every run.
    numbers : tuple of dict
        evaluation.json of each.
    steps : tuple of list of dict
        steps.csv of each.
    mismatches : tuple of str
        Why they do not fit together, in sentences.
    """

    names: tuple[str, ...]
    differing: dict[str, list]
    numbers: tuple[dict, ...]
    steps: tuple[list[dict], ...]
    mismatches: tuple[str, ...]

    @property
    def table(self) -> dict:
        """Options and numbers of each run by its name."""
        return {
            name: {key: values[i] for key, values in self.differing.items()} | self.numbers[i]
            for i, name in enumerate(self.names)
        }

    @property
    def length_unit(self) -> str:
        """The unit of the lengths of all runs; where they differ, that of their files."""
        units = {numbers.get("unit") for numbers in self.numbers}
        return str(units.pop()) if len(units) == 1 and None not in units else LENGTH

    def rows(self) -> list[tuple[str, list[str]]]:
        """What is printed: a quantity and its value for every run."""
        found = [(key, [_shown(v) for v in values]) for key, values in self.differing.items()]
        for name in _PRINTED:
            unit = self.length_unit if NUMBERS[name].unit == LENGTH else NUMBERS[name].unit
            label = name if unit == "–" else f"{name} ({unit})"
            found.append((label, [_shown(numbers.get(name)) for numbers in self.numbers]))
        return found

    def csv_bytes(self) -> bytes:
        """All options that differ and all numbers, a row for each run."""
        text = io.StringIO()
        # The tolerance is both an option and a number.
        names = list(dict.fromkeys((*self.differing, *NUMBERS)))
        writer = csv.writer(text)
        writer.writerow(["run", *names])
        for run, values in self.table.items():
            writer.writerow([run, *(values.get(name) for name in names)])
        return text.getvalue().encode()

    def png_bytes(self) -> bytes:
        """Coverage and mean error against tracked length, a curve for each run."""
        figure = canvas(10.0, 4.5, "constrained")
        left, right = figure.subplots(1, 2)
        for axes, column, label in (
            (left, "coverage", "coverage"),
            (right, "completeness_mean", f"mean error where covered ({self.length_unit})"),
        ):
            for name, steps in zip(self.names, self.steps, strict=True):
                points = [
                    (float(row["tracked_length"]), float(row[column]))
                    for row in steps
                    if row.get(column)
                ]
                axes.plot(*zip(*points, strict=True) if points else ([], []), "o-", ms=3)
                axes.lines[-1].set_label(name.replace("$", r"\$"))
            axes.set(xlabel="tracked length", ylabel=label)
        left.set_ylim(0, 1.02)
        if any(y > 0.0 for line in right.lines for y in line.get_ydata()):
            right.set_yscale("log")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center")
        return png_of(figure)

    def write(self, folder: Path) -> None:
        """Write compare.csv and compare.png."""
        make_out_folder(folder)
        for name, content in zip(FILES, (self.csv_bytes(), self.png_bytes()), strict=True):
            write_whole(folder / name, content)


def compare_runs(folders) -> Comparison:
    """Read runs to be compared.

    Raises
    ------
    ValueError
        When there are fewer than two, one of them twice, or one did not finish.
    """
    folders = [Path(folder) for folder in folders]
    if len({folder.resolve() for folder in folders}) < max(len(folders), 2):
        raise ValueError(f"runs to compare: got {len(folders)}; give two or more different ones")
    tables = [read_settings(folder) for folder in folders]
    for folder, table in zip(folders, tables, strict=True):
        check_explored(folder, table)
    settings = [_options(table) for table in tables]
    keys = {key: None for one in settings for key in one}
    differing = {key: [one.get(key) for one in settings] for key in keys}
    differing = {k: v for k, v in differing.items() if any(x != v[0] for x in v)}
    numbers = tuple(stored_numbers(folder) for folder in folders)
    return Comparison(
        _names(folders),
        differing,
        numbers,
        tuple(_steps(folder) for folder in folders),
        tuple(mismatches_of(tables, numbers)),
    )


def _names(folders) -> tuple[str, ...]:
    """The last parts of paths, as many as make them different."""
    paths = [folder.resolve().parts for folder in folders]
    count = 1
    while len({path[-count:] for path in paths}) < len(paths):
        count += 1
    return tuple(os.sep.join(path[-count:]) for path in paths)


def _options(table: dict) -> dict:
    """A run.toml with dotted names, without versions and digest."""
    return flattened({k: v for k, v in table.items() if k not in ("versions", "digest")})


def stored_numbers(folder: Path) -> dict:
    """The numbers in the evaluation.json of a run, those that are explained.

    Raises
    ------
    ValueError
        When there is none, or it cannot be read.
    """
    try:
        numbers = json.loads((folder / "evaluation.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        numbers = None
    if not isinstance(numbers, dict):
        raise ValueError(f"{folder} has no evaluation.json that can be read; {going_on(folder)}")
    return {name: value for name, value in numbers.items() if name in NUMBERS}


def _steps(folder: Path) -> list[dict]:
    """The rows of steps.csv."""
    path = folder / "steps.csv"
    try:
        rows = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
        for row in rows:
            for name in ("tracked_length", "coverage", "completeness_mean"):
                float(row[name] or 0.0)
    except (OSError, ValueError, KeyError, TypeError, csv.Error) as error:
        raise ValueError(f"{path} cannot be read ({error}); explore again") from None
    return rows


def _shown(value) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
