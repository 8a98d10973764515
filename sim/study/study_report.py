"""The report of a study: tables and pictures as one page of HTML and as PDF."""

import base64
import io
import json
import math
from collections.abc import Sequence
from html import escape
from pathlib import Path

from touchatlas.atlas.files import write_whole
from touchatlas.patch.words import count_of
from touchatlas.sim.study.about import about
from touchatlas.sim.study.cells import Row
from touchatlas.sim.study.compare import (
    COSTS,
    comparisons,
    gap_closed,
    median_interval,
    share_interval,
)
from touchatlas.sim.study.figures import canvas, image_bytes
from touchatlas.sim.study.study_file import StudyFile
from touchatlas.sim.study.study_pictures import pictures
from touchatlas.sim.study.tables import grouped

Table = tuple[str, list[str], list[list[str]]]
_STYLE = """body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;margin:1rem 0;font-size:.9rem;display:block;overflow-x:auto}
td,th{padding:.25rem .6rem;border-bottom:1px solid #ccc;text-align:right;white-space:nowrap}
td:first-child,th:first-child{text-align:left}img{max-width:100%}pre{overflow-x:auto;background:#f4f4f4;padding:1rem}"""


def write_report(study: StudyFile, text: str, rows: list[Row], folder: Path) -> list[Table]:
    """Write report.html, report.pdf and summary.json of a study's rows; returns its tables.

    ``text`` is that of the study's file.
    """
    made = about()
    tables = [settings_table(study, rows)]
    summary = {"settings": _dicts(tables[0]), **made}
    if study.baseline:
        tables += baseline_tables(study, rows)
        summary["against"] = [row for table in tables[1:] for row in _dicts(table)]
    tables += score_tables(study, rows)
    failed = failures(study, rows)
    drawn = pictures(study, rows)
    head = _head(study, rows, made)
    page = _html(study.name, head, [*tables, *failed], drawn, text)
    write_whole(folder / "report.html", page.encode())
    write_whole(folder / "report.pdf", _pdf(study.name, head, [*tables, *failed], drawn, text))
    write_whole(folder / "summary.json", (json.dumps(summary, indent=2) + "\n").encode())
    return [*tables, *failed]


def _dicts(table: Table) -> list[dict[str, str]]:
    _, headers, lines = table
    return [dict(zip(headers, line, strict=True)) for line in lines]


def _head(study: StudyFile, rows: list[Row], made: dict) -> list[str]:
    """What was run, in sentences."""
    sizes = (len(study.sources), "object"), (len(study.settings()), "setting")
    counts = [count_of(*one) for one in (*sizes, (len(study.seeds), "seed"))]
    words = ", ".join(f"{name} {value}" for name, value in made["versions"].items())
    machine = ", ".join(made["machine"].values())
    commit = f", commit {made['commit']}" if made["commit"] else ""
    return [
        f"{count_of(len(rows), 'run')}: {', '.join(counts)}.",
        f"Drawn with {words}{commit}, on {machine}; times.csv says where each run was measured.",
        "Repeat it by touchatlas study with the file below. A cell has the median and, in "
        "brackets, the interval that holds that of all such runs in 95 of 100 studies.",
    ]


def settings_table(study: StudyFile, rows: list[Row]) -> Table:
    """One line a setting: the share that met, and medians of the costs."""
    lines = []
    for key, own in grouped(rows, *study.varied).items():
        met = share_interval(sum(row["met"] == "1" for row in own), len(own))
        costs = [median_interval([cost(row) for row in own]) for cost in COSTS.values()]
        cells = [", ".join(key) or "all", str(len(own)), _percent(met)]
        lines.append([*cells, *(_interval(cost) for cost in costs)])
    return "Settings", [", ".join(study.varied) or "setting", "runs", "met", *COSTS], lines


def baseline_tables(study: StudyFile, rows: list[Row]) -> list[Table]:
    """Paired comparisons with the baseline, of costs and of what was met."""
    costs, met = comparisons(rows, list(study.varied), study.baseline)
    name, base = ", ".join(study.baseline), ", ".join(study.baseline.values())
    one = [
        [c.value, c.cost, str(c.pairs), _interval((c.ratio, c.low, c.high)), str(c.less)]
        + [str(c.more), _p(c.p)]
        for c in costs
    ]
    two = [[value, *map(str, counts), _p(p)] for value, *counts, p in met]
    title = f"Against {base}"
    return [
        (
            f"{title}: cost over the baseline's, of pairs that both met",
            [name, "cost", "pairs", "ratio", "less", "more", "p (Wilcoxon, Holm)"],
            one,
        ),
        (
            f"{title}: which of a pair met its tolerance",
            [name, "pairs", "only this", f"only {base}", "p (McNemar)"],
            two,
        ),
    ]


def score_tables(study: StudyFile, rows: list[Row]) -> list[Table]:
    """Share of the gap from random to oracle that each planner closes, where both are there."""
    found = []
    for flag, values in study.varied.items():
        if not {"random", "oracle"} <= {*values}:
            continue
        same = ("object", "seed", *(other for other in study.varied if other != flag))
        lines = []
        for value in values:
            closed = {c: gap_closed(rows, same, flag, value, cost) for c, cost in COSTS.items()}
            cells = (_interval(median_interval(own)) for own in closed.values())
            lines.append([value, str(len(closed["touches"])), *cells])
        title = "Score: share of the gap from random to oracle that is closed"
        found.append((title, [flag, "runs", *COSTS], lines))
    return found


def failures(study: StudyFile, rows: list[Row], most: int = 20) -> list[Table]:
    """The first runs that did not end by themselves."""
    bad = [row for row in rows if not row["touches"]]
    lines = [
        [row["object"], ", ".join(row[flag] for flag in study.varied), row["seed"], row["ended"]]
        for row in bad[:most]
    ]
    if not lines:
        return []
    title = f"Runs without a result: {len(bad)}"
    return [(title, ["object", ", ".join(study.varied) or "setting", "seed", "why"], lines)]


def _interval(found: Sequence[float]) -> str:
    middle, low, high = (f"{x:.3g}" if math.isfinite(x) else "" for x in found)
    return f"{middle} ({low} to {high})" if low else middle or "–"


def _percent(found: Sequence[float]) -> str:
    share, low, high = (f"{100.0 * x:.0f}" for x in found)
    return f"{share} % ({low} to {high})"


def _p(p: float) -> str:
    return "–" if math.isnan(p) else f"{p:.2g}" if p >= 1e-4 else "< 0.0001"


def _html(name: str, head, tables: list[Table], drawn: dict, text: str) -> str:
    """The page, which needs no other file."""
    parts = [f"<h1>{escape(name)}</h1>", *(f"<p>{escape(words)}</p>" for words in head)]
    for title, headers, lines in tables:
        cells = ("".join(f"<td>{escape(cell)}</td>" for cell in line) for line in lines)
        body = "".join(f"<tr>{line}</tr>" for line in cells)
        top = "".join(f"<th>{escape(header)}</th>" for header in headers)
        parts.append(f"<h2>{escape(title)}</h2><table><tr>{top}</tr>{body}</table>")
    for title, figure in drawn.items():
        data = base64.b64encode(image_bytes(figure)).decode()
        parts.append(f'<p><img alt="{title}" src="data:image/png;base64,{data}"></p>')
    parts.append(f"<h2>The study's file</h2><pre>{escape(text)}</pre>")
    start = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(name)}</title>'
    return f"{start}<style>{_STYLE}</style>{''.join(parts)}</html>\n"


def _pdf(name: str, head, tables: list[Table], drawn: dict, text: str) -> bytes:
    """The same as pages of A4."""
    from matplotlib.backends.backend_pdf import PdfPages

    words = [name, "", *(part for line in head for part in _wrapped(line)), ""]
    for title, headers, lines in tables:
        words += [title, *_columns([headers, *lines]), ""]
    words += ["The study's file", *text.splitlines()]
    file = io.BytesIO()
    with PdfPages(file, metadata={"CreationDate": None, "Title": name}) as pages:
        for first in range(0, len(words), 60):
            figure = canvas(11.7, 8.3)
            style = {"family": "monospace", "size": 6.5, "va": "top"}
            figure.text(0.03, 0.97, "\n".join(words[first : first + 60]), parse_math=False, **style)
            pages.savefig(figure)
        for figure in drawn.values():
            pages.savefig(figure)
    return file.getvalue()


def _wrapped(line: str, width: int = 150) -> list[str]:
    import textwrap

    return textwrap.wrap(line, width)


def _columns(lines: list[list[str]]) -> list[str]:
    """Lines of cells as text in columns."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return ["  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)) for line in lines]
