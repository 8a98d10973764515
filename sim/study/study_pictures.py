"""Pictures of a study: shares that met, touches of each object, and costs over the baseline's."""

import numpy as np

from touchatlas.sim.study.cells import Row
from touchatlas.sim.study.compare import COSTS, both_met, paired
from touchatlas.sim.study.figures import canvas, ratio_panels
from touchatlas.sim.study.study_file import StudyFile
from touchatlas.sim.study.tables import grouped, middle, number

# Colours of Okabe and Ito, and lines that differ besides.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999999")
LINES = ("-", "--", "-.", ":")


def pictures(study: StudyFile, rows: list[Row]) -> dict:
    """Figures by the names of their files."""
    done = [row for row in rows if row["touches"]]
    if not done:
        return {}
    drawn = {"profiles": profiles(study, rows), "objects": by_object(study, done)}
    if study.baseline:
        ratios = ratio_picture(study, done)
        drawn |= {"ratios": ratios} if ratios is not None else {}
    return drawn


def _styles(keys) -> dict:
    return {
        key: {"color": COLOURS[k % len(COLOURS)], "ls": LINES[k // len(COLOURS) % len(LINES)]}
        for k, key in enumerate(keys)
    }


def profiles(study: StudyFile, rows: list[Row]):
    """Share of the runs that had met their tolerance after so many touches and machine seconds."""
    figure, groups = canvas(11.0, 4.6), grouped(rows, *study.varied)
    panels = {"touches": "touches", "machine_seconds": "machine seconds"}
    styles = _styles(groups)
    for axes, (column, label) in zip(
        figure.subplots(1, 2, sharey=True), panels.items(), strict=True
    ):
        most = 1.05 * max(number(row[column]) for row in rows if row[column])
        for key, own in groups.items():
            cost = np.sort([number(row[column]) for row in own if row["met"] == "1"])
            share = np.array([*range(len(cost) + 1), len(cost)]) / len(own)
            style = styles[key] | {"label": ", ".join(key)}
            axes.step([0.0, *cost, most], share, where="post", **style)
        axes.set(xlabel=label, ylim=(0.0, 1.02), xlim=(0.0, most))
        axes.grid(alpha=0.25)
    figure.axes[0].set_ylabel("share of runs that met the tolerance")
    _legend(figure)
    return figure


def _legend(figure) -> None:
    handles, labels = figure.axes[0].get_legend_handles_labels()
    if any(labels):
        figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(labels)))


def by_object(study: StudyFile, rows: list[Row], most: int = 40):
    """Median touches of each of the first objects and settings; grey, and without a bar of colours,
    where no run met the tolerance."""
    objects = [name for (name,) in grouped(rows, "object")][:most]
    settings, cells = list(grouped(rows, *study.varied)), grouped(rows, "object", *study.varied)
    values = np.full((len(objects), len(settings)), np.nan)
    for line, name in enumerate(objects):
        for column, key in enumerate(settings):
            own = [row for row in cells.get((name, *key), ()) if row["met"] == "1"]
            values[line, column] = middle(number(row["touches"]) for row in own)
    figure = canvas(3.5 + 0.9 * len(settings), 1.8 + 0.3 * len(objects))
    axes = figure.subplots()
    shown = {"cmap": "cividis", "aspect": "auto"}
    image = axes.imshow(np.ma.masked_invalid(values), **shown)
    axes.set_facecolor("#dddddd")
    met = bool(np.isfinite(values).any())
    bright = np.nanmean(values) if met else 0.0
    for (line, column), value in np.ndenumerate(values):
        words = "not met" if np.isnan(value) else f"{value:.3g}"
        colour = "black" if np.isnan(value) or value > bright else "white"
        axes.text(column, line, words, ha="center", va="center", size=8, color=colour)
    axes.set_yticks(range(len(objects)), objects)
    names = [", ".join(key) or "all" for key in settings]
    axes.set_xticks(range(len(settings)), names, rotation=35, ha="right")
    if met:
        figure.colorbar(image, ax=axes, label="median touches")
    return figure


def ratio_picture(study: StudyFile, rows: list[Row]):
    """Costs over the baseline's, of pairs that both met; None where there is no pair."""
    names = ("touches", "machine seconds", "machine seconds to 99 %", "95 % error / tolerance")
    every = paired(rows, list(study.varied), study.baseline)
    pairs = {value: both_met(own) for value, own in every.items() if both_met(own)}
    if not pairs:
        return None
    figure = ratio_panels(
        {
            name: {
                value: [COSTS[name](row) / COSTS[name](other) for row, other in own]
                for value, own in pairs.items()
            }
            for name in names
        }
    )
    base_words = ", ".join(study.baseline.values())
    figure.suptitle(f"cost over that of {base_words}: left of the line is cheaper")
    return figure
