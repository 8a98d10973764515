"""Progress of a run: a row of steps.csv for each touch, and the curves of progress.png."""

import csv
import io
import math
from pathlib import Path

import numpy as np

from touchatlas.atlas import Atlas, TouchStatus
from touchatlas.planner import Step
from touchatlas.sim.look.canvas import canvas, png_of
from touchatlas.sim.look.curves import chart

_COLUMNS = (
    "touch",
    "reason",
    "x",
    "y",
    "z",
    "contours",
    "tracked_length",
    "travel_length",
    "patches",
    "predicted_deviation",
    "coverage",
    "completeness_mean",
    "seconds_plan",
    "seconds_fit",
    "seconds_sim",
    "predicted_coverage",
)
# Columns that a process that goes on with a run takes from the one before it.
SECONDS = ("seconds_plan", "seconds_fit", "seconds_sim")


class Progress:
    """The cost of each touch, and what is known after it.

    Parameters
    ----------
    atlas : Atlas
        The atlas that the exploration builds.
    points : (n, 3) float, length
        Points of the true surface; every few touches the atlas is compared with them.
    """

    def __init__(self, atlas: Atlas, points) -> None:
        self._atlas, self._points = atlas, points
        self.rows: list[dict] = []
        self.not_touched = 0
        self.refusals: list[str] = []

    def add(self, step: Step, seconds) -> None:
        """Add a row for one touch; every fifth one has the truth's columns filled.

        ``seconds`` (3,) are those of planning, learning and the simulated probe.
        """
        atlas, touch = self._atlas, step.touch
        self.not_touched += touch.status is not TouchStatus.TOUCHED
        if step.change.refused and touch.status is TouchStatus.TOUCHED:
            self.refusals.append(step.change.refused)
        values = (
            step.plan.number,
            step.plan.reason.value,
            *touch.contact.tolist(),
            len(touch.contours),
            self.last("tracked_length") + touch.tracked_length,
            self.last("travel_length") + touch.travel_length,
            len(atlas),
            "",
            "",
            "",
            *seconds,
            step.plan.known,
        )
        self.rows.append(dict(zip(_COLUMNS, values, strict=True)))
        if step.plan.number % 5 == 0:
            self.measure()

    def measure(self) -> None:
        """Fill the truth's columns of the last row: the fraction of true points within three
        tolerances of the atlas, their mean error, and what was predicted of it."""
        if not self.rows:
            return
        found = self._atlas.blend(self._points)
        distance = np.abs(found.distance)
        near = distance <= 3.0 * self._atlas.tolerance
        values: dict = {"coverage": float((distance <= self._atlas.tolerance).mean())}
        if near.any():
            predicted = float(np.sqrt((found.deviation[near] ** 2).mean()))
            error = float(distance[near].mean())
            values |= {"predicted_deviation": predicted, "completeness_mean": error}
        self.rows[-1] |= values

    def last(self, column: str) -> float:
        """A column of the last row, 0 before the first."""
        return self.rows[-1][column] if self.rows else 0.0

    def sum(self, column: str) -> float:
        """A column summed over the rows."""
        return sum(row[column] for row in self.rows)

    def csv_bytes(self) -> bytes:
        """The rows as steps.csv."""
        return _csv(self.rows, header=True)

    def last_row_bytes(self) -> bytes:
        """The last row as a line of steps.csv, with the header before the first."""
        return _csv(self.rows[-1:], header=len(self.rows) == 1)

    def png_bytes(self, name: str, unit: str = "") -> bytes:
        """Coverage, predicted deviation and mean error against tracked length, with its unit, as
        progress.png."""
        figure = canvas(10.0, 4.0)
        left, right = figure.subplots(1, 2)
        figure.subplots_adjust(left=0.07, right=0.985, bottom=0.13, top=0.92, wspace=0.22)
        self._curve(left, "predicted_coverage", "predicted coverage", "-")
        self._curve(left, "coverage", "coverage", "o-")
        unit = f" ({unit})" if unit else ""
        left.set(xlabel=f"tracked length{unit}", ylabel="share of the surface", ylim=(0, 1.02))
        # A title of a given height need not be kept clear of the ticks.
        left.set_title(name, y=1.0, parse_math=False)
        left.legend()
        self._curve(right, "predicted_deviation", "predicted, root mean square", "o-")
        self._curve(right, "completeness_mean", "mean error where covered", "o-")
        right.set(xlabel=f"tracked length{unit}", ylabel=f"length{unit}")
        right.set_title("deviation and error", y=1.0)
        if any(y > 0.0 for line in right.lines for y in line.get_ydata()):
            right.set_yscale("log")
        right.legend()
        return png_of(figure)

    def charts(self, unit: str) -> str:
        """The same curves against touches, as HTML."""
        columns = {
            name: [row[name] if row[name] != "" else None for row in self.rows]
            for name in ("predicted_coverage", "coverage", "predicted_deviation")
        }
        columns["error"] = [row["completeness_mean"] or None for row in self.rows]
        known = {"predicted": columns["predicted_coverage"], "true": columns["coverage"]}
        error = {"predicted": columns["predicted_deviation"], "true mean": columns["error"]}
        length = {"in contact": [row["tracked_length"] for row in self.rows]}
        length["in the air"] = [row["travel_length"] for row in self.rows]
        parts = (
            chart("Known to the tolerance", known, top=1.0),
            chart("Deviation and error", error, unit),
            chart("Path of the probe", length, unit, top=max(map(max, length.values()))),
        )
        return "".join(parts)

    def _curve(self, axes, column: str, label: str, style: str) -> None:
        """A column against tracked length, where it is filled."""
        seen = [row for row in self.rows if row[column] != ""]
        length = [row["tracked_length"] for row in seen]
        axes.plot(length, [row[column] for row in seen], style, ms=3, label=label)


def _csv(rows: list[dict], header: bool) -> bytes:
    """Rows as CSV."""
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=_COLUMNS)
    if header:
        writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def read_seconds(path: Path) -> list[tuple[float, ...]]:
    """The seconds of the touches of a steps.csv, as far as it can be read."""
    found: list[tuple[float, ...]] = []
    try:
        with open(path, newline="", encoding="utf-8") as file:
            for row in csv.DictReader(file):
                seconds = tuple(float(row[name]) for name in SECONDS)
                if int(row["touch"]) != len(found) or not all(map(math.isfinite, seconds)):
                    break
                found.append(seconds)
    except (OSError, ValueError, KeyError, TypeError, csv.Error):
        pass
    return found
