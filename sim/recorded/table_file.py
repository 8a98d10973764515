"""A text file as columns of cells: separators, decimals, and what lines are points.

Points are the lines with the commonest number of cells of those that hold three numbers or more.
Lines above the first may name the columns; lines of words below it may part curves.
"""

import csv
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from touchatlas.sim.recorded.text_file import NUMBER, read_lines
from touchatlas.sim.world.units import UNITS

_SEPARATORS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", None: "spaces"}
_COMMENT = re.compile(r"^\s*\"?(#+|%+|//+|\$\$|!|\((?=\s*[A-Za-z]))\s*")
_NUMBER = re.compile(rf"{NUMBER}|[+-]?(?:nan(?:\(ind\))?|inf|infinity)", re.IGNORECASE)
_EXCEL = re.compile(r'"?sep=(\\t|[\t;|,])"?', re.I)


@dataclass(eq=False)
class Table:
    """The cells of a file.

    Parameters
    ----------
    columns : list of list of str
        Cells, column by column.
    lines : (n,) int
        Number of the line of each row.
    blocks : dict of str to (n,) int
        Number of the block of each row, between "empty lines" and between "lines of words".
    above : list of list of str
        Rows of words above the points that may name their columns, the nearest first.
    words : list of (int, str)
        Number and text of the lines that hold no point.
    separator : str
        What separates cells, as a word.
    decimal_comma : bool
    unit : str
        That stands after each number, "" where none does.
    assumed, warnings : list of str
        What was found out about the file, and what is probably wrong with it, in sentences.
    """

    columns: list[list[str]]
    lines: np.ndarray
    blocks: dict[str, np.ndarray]
    above: list[list[str]]
    words: list[tuple[int, str]]
    separator: str
    decimal_comma: bool
    unit: str = ""
    assumed: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def numbers(self, place: int) -> np.ndarray:
        """(n,) numbers of a column; NaN where a cell is none."""
        cells = self.columns[place]
        if self.decimal_comma:
            cells = [c if "." in c else c.replace(",", ".") for c in cells]
        try:
            if not any("_" in cell for cell in cells):
                return np.array(cells, dtype=float)
        except ValueError:
            pass
        return np.array([_float(cell) for cell in cells])


def _float(cell: str) -> float:
    try:
        # Python reads 1_000 as a number; files do not mean it.
        return float("nan") if "_" in cell else float(cell)
    except ValueError:
        return float("nan")


def read_table(path: Path) -> Table:
    """The cells of a text file.

    Raises
    ------
    ValueError
        In one sentence: no text, no points, cells whose quotes do not match, or a line of numbers
        that has more or fewer cells than most.
    """
    file = read_lines(path)
    if not any(line.strip() for line in file.lines):
        raise ValueError(f"{path} is empty; give a file with a line for each point: curve, x, y, z")
    named = _EXCEL.fullmatch(file.lines[0].strip(" "))
    if named:
        file.lines[0] = ""
    bare = [line for line in file.lines if line.strip() and not _COMMENT.match(line)]
    separator = named[1].replace("\\t", "\t") if named else _separator(bare[:1000])
    rows = _rows(path, file.lines, separator)
    width, least = _shape(path, rows)
    first = next(i for i, r in enumerate(rows) if r and len(r) == width and _count(r) >= least)
    kept, blocks, words = _points(path, rows, first, width, file.lines)
    columns = [list(column) for column in zip(*(rows[i] for i in kept), strict=True)]
    table = Table(
        columns,
        np.array(kept) + 1,
        blocks,
        [file.header] if file.header else _above(file.lines[:first], separator, width),
        words,
        _SEPARATORS[separator],
        any("," in c for column in columns for c in column if _NUMBER.fullmatch(c)),
        UNITS.get(file.unit.lower(), ""),
        list(file.assumed or []),
    )
    table.assumed.append(f"cells are separated by {table.separator}")
    if table.decimal_comma:
        table.assumed.append("decimals are written with a comma")
    return table


def _separator(lines: list[str]) -> str | None:
    """What separates the cells; None for spaces: what makes most lines of three numbers."""

    def score(separator: str | None) -> tuple[int, int, int]:
        cells = [[c.strip(' "') for c in line.split(separator)] for line in lines]
        counts = [_count(row) for row in cells]
        return sum(count >= 3 for count in counts), sum(counts), sum(map(len, cells))

    return max(_SEPARATORS, key=score)


def _count(cells: list[str]) -> int:
    """How many cells are numbers."""
    return sum(_NUMBER.fullmatch(cell) is not None for cell in cells)


def _rows(path: Path, lines: list[str], separator: str | None) -> list[list[str] | None]:
    """Cells of each line: an empty list for an empty line, None for a comment."""
    rows: list[list[str] | None] = []
    for number, line in enumerate(lines, 1):
        if _COMMENT.match(line):
            rows.append(None)
        elif separator is not None and '"' in line:
            try:
                cells = next(csv.reader([line], delimiter=separator, strict=True))
            except csv.Error as error:
                raise ValueError(f"{path}, line {number}: {error}; correct the quoting") from None
            rows.append([cell.strip() for cell in cells])
        else:
            cells = [cell.strip() for cell in line.split(separator)]
            rows.append(cells if any(cells) else [])
    # A separator at the end of each line makes no column.
    full = [row for row in rows if row]
    if sum(row[-1] == "" for row in full) > 0.8 * len(full):
        rows = [row[:-1] if row and row[-1] == "" else row for row in rows]
    return rows


def _shape(path: Path, rows) -> tuple[int, int]:
    """The commonest number of cells of lines with three numbers, or with as many as there are."""
    counts = [(len(row), _count(row)) for row in rows if row]
    for least in (3, 2, 1):
        widths = Counter(width for width, count in counts if count >= least)
        if widths:
            return widths.most_common(1)[0][0], least
    what = "no points below its header" if counts else "only comments"
    raise ValueError(
        f"{path} has {what}: no line holds a number; give a line for each point: curve, x, y, z"
    )


def _points(path: Path, rows, first: int, width: int, lines):
    """Lines that are points, the blocks that they make, and the lines that are none."""
    kept: list[int] = []
    empty: list[int] = []
    worded: list[int] = []
    words = [(i + 1, lines[i]) for i in range(first) if lines[i].strip()]
    gap, word = 0, 0
    for i in range(first, len(rows)):
        row = rows[i]
        if row == []:
            gap += bool(kept) and empty[-1] == gap
            continue
        if row is None or _count(row) < min(2, width) and (len(row) != width or not _count(row)):
            words.append((i + 1, lines[i]))
            word += bool(kept) and worded[-1] == word
            continue
        if len(row) > width and not any(row[width:]):
            rows[i] = row = row[:width]
        if len(row) != width:
            advice = (
                "fill them in, or delete the line"
                if len(row) < width
                else "write decimals with a point, or separate cells by semicolons"
            )
            raise ValueError(
                f"{path}, line {i + 1} has {len(row)} cells, but most lines {width}; {advice}"
            )
        kept.append(i)
        empty.append(gap)
        worded.append(word)
    blocks = {"empty lines": np.array(empty), "lines of words": np.array(worded)}
    return kept, blocks, words


def _above(lines: list[str], separator: str | None, width: int) -> list[list[str]]:
    """Rows of as many words as there are columns, the nearest first."""
    found = []
    for line in reversed(lines):
        text = _COMMENT.sub("", line, count=1).rstrip("\r\n")
        for by in (separator, ",", ";", "\t", None):
            cells = [cell.strip(' "') for cell in text.split(by)]
            extra = len(cells) == width + 1
            # A word before the names, a separator after them, or no name for the number of a row.
            cells = cells[:-1] if extra and not cells[-1] else cells[1:] if extra else cells
            cells = ["", *cells] if len(cells) == width - 1 > 2 else cells
            if len(cells) == width and not _count(cells) and any(cells):
                found.append(cells)
                break
    return found
