"""A text file of numbers as people have them: separators, decimals, comments and header found out.

Python's csv module reads the cells. What was found out is said, so that the user can object.
"""

import csv
import re
from dataclasses import dataclass, field
from pathlib import Path

_SEPARATORS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas"}
_COMMENTS = ("#", "%", "//")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.I)
_NAMED = re.compile(r'"?sep=(\\t|[\t;|,])"?', re.I)


@dataclass
class Table:
    """The cells of a file.

    Parameters
    ----------
    header : list of str, optional
        None where the file has none.
    rows : list of (line, block, cells)
        Number of the line, number of the block of lines between empty ones, and text of the cells.
    assumed : list of str
        What was found out about the file, in sentences.
    decimal_comma : bool
    warnings : list of str
        What is probably wrong with the file, in sentences.
    unit : str
        Of the lengths, where the file says it.
    """

    header: list[str] | None
    rows: list[tuple[int, int, list[str]]]
    assumed: list[str] = field(default_factory=list)
    decimal_comma: bool = False
    warnings: list[str] = field(default_factory=list)
    unit: str = ""

    def number(self, cell: str) -> float:
        """The number of a cell; NaN if it is none."""
        if self.decimal_comma and "." not in cell:
            cell = cell.replace(",", ".")
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
        In one sentence: no text, or cells whose quotes do not match.
    """
    assumed: list[str] = []
    lines = _text(path, assumed).splitlines()
    # Excel's own first line.
    named = _NAMED.fullmatch(lines[0].strip(" ")) if lines else None
    lines[:1] = [""] if named else lines[:1]
    comments = {i: line for i, line in enumerate(lines) if line.lstrip().startswith(_COMMENTS)}
    kept = ["" if i in comments else line for i, line in enumerate(lines)]
    named_separator = {"\\t": "\t"}.get(named[1], named[1]) if named else None
    separator = named_separator or _separator([line for line in kept if line.strip()][:500])
    rows = _cells(path, kept, separator, set(comments))
    table = Table(None, rows, assumed)
    if separator != ",":
        name = _SEPARATORS.get(separator or "", "spaces")
        assumed.append(f"cells are separated by {name}")
    if rows and not any(_NUMBER.fullmatch(cell) for cell in rows[0][2]):
        table.header = rows.pop(0)[2]
    elif rows:
        table.header = _commented_header(comments, rows[0], separator, assumed)
    if comments:
        assumed.append(f"lines of comment were skipped: {len(comments)}")
    data = [cell for _, _, cells in rows for cell in cells if _NUMBER.fullmatch(cell)]
    table.decimal_comma = any("," in cell for cell in data)
    if table.decimal_comma:
        assumed.append("decimals are written with a comma")
    return table


def _text(path: Path, assumed: list[str]) -> str:
    """The text of a file, whatever its encoding."""
    data = path.read_bytes()
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    encodings = ["utf-16"] if wide else ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" in text:
            break
        if encoding != "utf-8-sig":
            assumed.append(f"the text is not UTF-8; it was read as {encoding}")
        return text
    raise ValueError(f"{path} is no text; save it as CSV in UTF-8")


def _separator(lines: list[str]) -> str | None:
    """What separates the cells; None for spaces."""
    for separator in ("\t", ";", "|"):
        if _often([line.count(separator) >= 2 for line in lines]):
            return separator
    words = [line.split() for line in lines]
    if _often([len(w) >= 3 and all(map(_NUMBER.fullmatch, w[-3:])) for w in words[1:] or words]):
        return None
    return ","


def _often(found: list[bool]) -> bool:
    # One bad line must not hide what separates the others.
    return sum(found) >= 0.8 * len(found) and any(found)


def _cells(path: Path, lines, separator, comments) -> list[tuple[int, int, list[str]]]:
    """Rows of cells, with the numbers of their lines and of the blocks between empty lines."""
    rows, block, empty = [], 0, True
    if separator is None:
        reader = ((i, line.split()) for i, line in enumerate(lines, 1))
    else:
        reader = _read_csv(path, lines, separator)
    for number, row in reader:
        cells = [cell.strip() for cell in row]
        if any(cells):
            rows.append((number, block, cells))
            empty = False
        elif not empty and number - 1 not in comments:
            block, empty = block + 1, True
    return rows


def _read_csv(path: Path, lines, separator: str):
    reader = csv.reader((line + "\n" for line in lines), delimiter=separator, strict=True)
    try:
        for row in reader:
            yield reader.line_num, row
    except csv.Error as error:
        raise ValueError(f"{path}, line {reader.line_num}: {error}; correct the quoting") from None


def _commented_header(comments, first, separator, assumed) -> list[str] | None:
    """The names in the comment before the first row, if there is one for each cell."""
    before = [i for i in comments if i < first[0] - 1]
    if not before:
        return None
    text = comments[before[-1]].lstrip("".join(_COMMENTS) + " ")
    for names in (text.split(separator), text.split(","), text.split()):
        named = all(re.search(r"[A-Za-z]", name) for name in names)
        if len(names) == len(first[2]) and named:
            assumed.append(f"the names of the columns are those in line {before[-1] + 1}")
            return [name.strip() for name in names]
    return None
