"""Where methods fail: families of ever harder cases, of one patch and of whole surfaces."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from rich.box import SIMPLE
from rich.table import Table

from touchatlas.patch.entry_points import ESTIMATORS, added
from touchatlas.sim.study.cells import Cell, Row
from touchatlas.sim.study.explorations import ATLAS_FAMILIES, atlas_verdict
from touchatlas.sim.study.families import FAMILIES
from touchatlas.sim.study.figures import canvas
from touchatlas.sim.study.fits import added_fits
from touchatlas.sim.study.one_patch import METHODS, answered, verdict
from touchatlas.sim.study.outcome import Outcome, Verdict
from touchatlas.sim.study.study import Chart, Study
from touchatlas.sim.study.tables import Summed, grouped, middle, number

COLUMNS = (
    *("family", "severity", "draw", "method", "outcome", "error", "height_ratio"),
    *("normal_ratio", "curvature_ratio", "held", "claim", "doubts", "words"),
)
_SHARES = ("good", "flagged", "refused", "wrong", "crashed", "good but doubted", "three noises")
# Colours of Okabe and Ito, which differ for all kinds of colour vision, and hatches besides.
COLOURS = {
    Outcome.GOOD: ("#009E73", ""),
    Outcome.FLAGGED: ("#F0E442", "////"),
    Outcome.REFUSED: ("#BBBBBB", "...."),
    Outcome.WRONG: ("#D55E00", "xxxx"),
    Outcome.CRASHED: ("#000000", ""),
}


def measure_patch(
    name: str, severity: float, draws: int, seed: int, others: Sequence[str] = ()
) -> list[Row]:
    """The rows of one severity of a family of one patch; ``others`` are estimators that other
    packages add."""
    rows, methods = [], METHODS | {n: answered(fit) for n, fit in added_fits(others).items()}
    for draw in range(draws):
        case, _ = FAMILIES[name].case(name, severity, draw, seed)
        for method, answer in methods.items():
            rows.append(_row(name, severity, draw, method, verdict(answer, case)))
    return rows


def measure_atlas(name: str, severity: float, draws: int, seed: int) -> list[Row]:
    """The rows of one severity of a family of whole surfaces."""
    rows = []
    for draw in range(draws):
        trial, rng = ATLAS_FAMILIES[name].case(name, severity, draw, seed)
        rows.append(_row(name, severity, draw, "atlas", atlas_verdict(trial, rng)))
    return rows


def _row(name: str, severity: float, draw: int, method: str, found: Verdict) -> Row:
    values = (
        *(name, repr(severity), str(draw), method, found.outcome.value),
        *(f"{x:.4g}" for x in (found.error, *found.ratios, found.held, found.claim)),
        *("; ".join(found.doubts), found.words),
    )
    return dict(zip(COLUMNS, values, strict=True))


def shares(rows: list[Row]) -> dict[str, float]:
    """Fraction of each outcome, and of the good ones that are doubted.

    >>> shares([{"outcome": "good", "doubts": ""}, {"outcome": "wrong", "doubts": ""}])["wrong"]
    0.5
    """
    count = Counter(row["outcome"] for row in rows)
    doubted = sum(row["outcome"] == Outcome.GOOD.value and bool(row["doubts"]) for row in rows)
    found = {outcome.value: count[outcome.value] / len(rows) for outcome in Outcome}
    return found | {"good but doubted": doubted / len(rows)}


def summary(rows: list[Row]) -> Summed:
    """One row a family and method, and one a method over all families, called "all".

    Each has ``shares``, the median ``error`` of the cases with an answer, the share of all cases
    whose error is ``three noises`` at most, and the fraction of points ``held`` by 95 % intervals
    over good and flagged cases.
    """
    found = []
    for (method,), own in grouped(rows, "method").items():
        parts = {family: part for (family,), part in grouped(own, "family").items()}
        for family, part in (parts | {"all": own}).items():
            given = [r for r in part if r["outcome"] in (Outcome.GOOD.value, Outcome.FLAGGED.value)]
            held = [number(row["held"]) for row in given]
            found.append(
                {"family": family, "method": method, "cases": len(part)}
                | shares(part)
                | {"error": middle(number(row["error"]) for row in part)}
                | {"three noises": float(np.mean([number(r["error"]) <= 3.0 for r in part]))}
                | {"held": float(np.nanmean(held)) if not np.isnan(held).all() else np.nan}
            )
    return found


def table(rows: list[Row], summed: Summed) -> Table:
    """Shares of the outcomes, one row a method, and the families where our default is wrong."""
    shown = Table("method", *_SHARES, title="shares of outcomes over all families", box=SIMPLE)
    alone = [r for r in summed if r["family"] != "all" and r["wrong"] > 0.0]
    for row in [r for r in summed if r["family"] == "all"]:
        shown.add_row(row["method"], *(f"{row[name]:.1%}" for name in _SHARES))
    for row in [r for r in alone if r["method"] in ("map", "atlas")]:
        words = f"{row['method']}: {row['family']}"
        shown.add_row(words, *(f"{row[name]:.1%}" for name in _SHARES))
    return shown


def family_picture(name: str, family, rows: list[Row], error: str):
    """One family: its median errors and the shares of its outcomes, severity against method."""
    cells = grouped(rows, "method", "severity")
    methods = [method for (method,) in grouped(rows, "method")]
    figure = canvas(9.0, 3.9 + 0.54 * len(methods))
    errors, outcomes = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 1.25))
    values = [
        [
            middle(number(row["error"]) for row in cells.get((method, repr(s)), ()))
            for s in family.severities
        ]
        for method in methods
    ]
    _heat(figure, errors, np.array(values), methods, error)
    for line, method in enumerate(methods):
        for column, severity in enumerate(family.severities):
            if own := cells.get((method, repr(severity))):
                _bars(outcomes, shares(own), column, line - 0.4)
    outcomes.set_yticks(range(len(methods)), methods)
    outcomes.set_xticks(range(len(family.severities)), [f"{s:g}" for s in family.severities])
    outcomes.set_xlabel(family.title)
    handles, labels = outcomes.get_legend_handles_labels()
    entries = dict(zip(labels, handles, strict=True))
    words = {"loc": "center left", "bbox_to_anchor": (1.01, 0.5), "title": "share of cases"}
    outcomes.legend(entries.values(), entries, **words)
    figure.suptitle(f"{name}: {len(rows) // len(methods)} cases")
    return figure


def _heat(figure, axes, values, methods, title: str, least: float = 0.1, most: float = 1e3):
    """Values (m, s) as colours on a logarithmic scale, each with its number."""
    from matplotlib.colors import LogNorm

    shown = {"cmap": "cividis", "norm": LogNorm(least, most), "aspect": "auto", "origin": "lower"}
    image = axes.imshow(np.ma.masked_invalid(values), **shown)
    for (line, column), value in np.ndenumerate(values):
        words = "none" if np.isnan(value) else f"{value:.2g}" if value < 1e4 else f"{value:.0e}"
        light = np.isnan(value) or value > np.sqrt(least * most)
        _write(axes, column, line, words, light, 8)
    axes.set_yticks(range(len(methods)), methods)
    figure.colorbar(image, ax=axes, label=title)


def _bars(axes, found: dict[str, float], column: int, base: float) -> None:
    """Shares of the outcomes as one stacked bar."""
    for outcome, (colour, hatch) in COLOURS.items():
        height, edge = 0.8 * found[outcome.value], outcome is Outcome.WRONG
        style = {"color": colour, "hatch": hatch, "edgecolor": "white" if edge else "#555555"}
        axes.bar(column, height, 0.9, base, linewidth=0.3, label=outcome.value, **style)
        base += height


def _write(axes, column: int, line: int, words: str, light: bool, size: int) -> None:
    colour = "black" if light else "white"
    axes.text(column, line, words, ha="center", va="center", color=colour, size=size)


def overview_picture(summed: Summed, near: str):
    """Shares of wrong cases and of small errors, family against method."""
    found = {(row["family"], row["method"]): row for row in summed}
    families, methods = (
        list(dict.fromkeys(row[n] for row in summed)) for n in ("family", "method")
    )
    figure = canvas(8.5, 2.0 + 0.26 * len(families))
    axes = figure.subplots(1, 2, sharey=True)
    for panel, name, title in zip(axes, ("wrong", "three noises"), ("wrong, %", near), strict=True):
        values = np.array(
            [[found[f, m][name] if (f, m) in found else np.nan for m in methods] for f in families]
        )
        bad = values if name == "wrong" else 1.0 - values
        panel.imshow(bad, cmap="cividis", vmin=0.0, vmax=1.0, aspect="auto")
        for (line, column), value in np.ndenumerate(values):
            _write(panel, column, line, f"{100.0 * value:.0f}", bool(bad[line, column] > 0.5), 7)
        panel.set_xticks(range(len(methods)), methods, rotation=35, ha="right")
        panel.set_title(title)
    axes[0].set_yticks(range(len(families)), families)
    return figure


def _chart(
    name: str, families, measure, draws: int, error: str, near: str, group: str = ""
) -> Chart:
    """A study of families that are measured alike; ``error`` says what the column is, and ``near``
    what is counted where it is three at most. What other packages add to a group is measured, too.
    """

    def cells(names: tuple[str, ...], count: int, seed: int) -> list[Cell]:
        others = (list(added(group)),) if group and added(group) else ()
        return [
            Cell(
                f"{one}-{seed}.csv",
                {"family": one, "severity": repr(severity)},
                (one, severity, count, seed, *others),
            )
            for one in names or families
            for severity in families[one].severities
        ]

    def pictures(rows: list[Row], summed: Summed) -> dict:
        drawn = {
            one: family_picture(one, families[one], own, error)
            for (one,), own in grouped(rows, "family").items()
        }
        return drawn | {name: overview_picture(summed, near)}

    measured = Study(name, COLUMNS, measure, "words", {"outcome": Outcome.CRASHED.value})
    return Chart(
        *(measured, cells, summary, pictures, table, draws),
        keeps_summary=True,
        words=("measuring", "severities"),
    )


ONE_PATCH = _chart(
    *("stability", FAMILIES, measure_patch, 25),
    *("median error of heights / noise", "heights within 3 noises, %", ESTIMATORS),
)
MANY_PATCHES = _chart(
    *("stability_atlas", ATLAS_FAMILIES, measure_atlas, 2),
    *("largest error / tolerance, median", "surface within 3 tolerances, %"),
)


def charts_of(names: tuple[str, ...]) -> list[tuple[Chart, tuple[str, ...]]]:
    """The charts that have families of these names, each with its own ones; for no name all
    families of one patch. ValueError for a name that is none."""
    for name in names:
        if name not in FAMILIES | ATLAS_FAMILIES:
            known = ", ".join(FAMILIES | ATLAS_FAMILIES)
            raise ValueError(f"there is no family {name!r}; choose from {known}")
    chosen = names or tuple(FAMILIES)
    parts = ((ONE_PATCH, FAMILIES), (MANY_PATCHES, ATLAS_FAMILIES))
    found = [(study, tuple(n for n in chosen if n in families)) for study, families in parts]
    return [(study, own) for study, own in found if own]
