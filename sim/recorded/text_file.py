"""A text file as lines, in one kind of minus, and of one point a line.

Lines of controls hold points among words: grbl's ``[PRB:x,y,z:1]``, words of G-code, ``x: 1``
under each other as topics are echoed, ``"x": 1`` as in JSON. Each becomes a line of cells.
"""

import re
from dataclasses import dataclass
from pathlib import Path

NUMBER = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?"
_MINUS = str.maketrans(dict.fromkeys("\u2212\u2010\u2011\u2013\uff0d", "-") | {"\u3000": " "})
_KANJI = re.compile(r"[\u3040-\u30ff\u4e00-\u9fff\uff01-\uff5e\u3000-\u303f]*")
_PROBED = re.compile(r"\[PRB:([^:\]]*):([01])\]")
_NAMED = re.compile(r'\b([xyz])"?\s*[:=]?\s*"?([+-]?[\d.]+(?:[eE][+-]?\d+)?)', re.IGNORECASE)
_BRACKETED = re.compile(r"[\s\d.,;+eE-]*[\[({][\s\[\](){}\d.,;+eE-]*")
# What a move may hold beside its words: numbers of blocks, and words of Heidenhain without numbers.
_BESIDE = re.compile(r"(?:\d+|LN?|F ?MAX|R[0LR]|M|[\s/%])*", re.IGNORECASE)
_WITH_UNIT = re.compile(rf"({NUMBER})\s*(mm|cm|um|µm|inch|in|m)(?=\s*(?:[,;\t|]|$))", re.IGNORECASE)
_CODE = re.compile(r"([A-Z])\s*([+-]?(?:\d+\.?\d*|\.\d+))", re.IGNORECASE)
_ECHOED = re.compile(
    r"\s*\n\s*".join(rf"\b{axis}:\s*({NUMBER}|\.?nan)" for axis in "xyz") + r"(?!\S|\s*\n\s*w:)"
)


@dataclass
class Lines:
    """Lines of a file, names of their cells where these are known, and what was found out."""

    lines: list[str]
    header: list[str] | None = None
    assumed: list[str] | None = None
    unit: str = ""


def read_lines(path: Path) -> Lines:
    """The lines of a text file, whatever its encoding.

    Raises
    ------
    ValueError
        In one sentence: the file is no text.
    """
    assumed: list[str] = []
    text = _text(path, assumed).translate(_MINUS)
    if _ECHOED.search(text):
        assumed.append("x:, y:, z: on lines that follow each other are one point")
        text = _ECHOED.sub(r"\1 \2 \3\n\n", text)
        return Lines(_split(text), ["x", "y", "z"], assumed)
    if text.count("\n") < 3:
        # A list of lists, as JSON writes it.
        text = re.sub(r"\]\s*,\s*\[", "]\n[", text)
    text = re.sub(r"(\d\.\d*)[dD]([+-]\d+)", r"\1e\2", text)
    lines = _split(text)
    if path.suffix.lower() == ".ptx":
        # Sizes, and where the scanner stood.
        lines[:10] = [f"# {line}" for line in lines[:10]]
    if any("[PRB:" in line for line in lines):
        assumed.append("[PRB:x,y,z:hit] are points")
        found = (_PROBED.search(line) for line in lines)
        told = [f"{m[1]},{m[2]}" if m else w for m, w in zip(found, lines, strict=True)]
        return Lines(told, ["x", "y", "z", "hit"], assumed)
    if any(re.match(r"\s*ACTL/", line) for line in lines):
        assumed.append("ACTL/ are points, as measured")
        return Lines([_actual(line) for line in lines], None, assumed)
    return _cells_of(lines, assumed)


def _cells_of(lines: list[str], assumed: list[str]) -> Lines:
    """Lines of a table, of moves, of named numbers, or of numbers with their unit."""
    lines = [
        re.sub(r"[\[\](){}]", "", line) if _BRACKETED.fullmatch(line) else line for line in lines
    ]
    full = [line for line in lines[:500] if line.strip()]
    if 2 * sum(_code(line) is not None for line in full) > len(full):
        assumed.append("X, Y, Z of G-code are coordinates, G0 parts curves")
        return Lines(_modal(lines), ["x", "y", "z"], assumed)
    if 2 * sum(len(_NAMED.findall(line)) >= 3 for line in full) > len(full):
        assumed.append("numbers after x, y, z are coordinates")
        return Lines([_named(line) for line in lines], ["x", "y", "z"], assumed)
    units = [[found[1] for found in _WITH_UNIT.findall(line)] for line in full]
    if 2 * sum(len(found) >= 3 for found in units) > len(full):
        unit = next(found[-1] for found in units if found)
        assumed.append(f"{unit} stands after each number")
        return Lines([_WITH_UNIT.sub(r"\1", line) for line in lines], None, assumed, unit)
    return Lines(lines, None, assumed)


def _split(text: str) -> list[str]:
    return re.split(r"\r\n|\r|\n", text)


def _text(path: Path, assumed: list[str]) -> str:
    """The text of a file: Unicode, else Japanese where all special letters are, else Western."""
    data = path.read_bytes()
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    for encoding in ["utf-16"] if wide else ["utf-8-sig", "cp932", "cp1252"]:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" in text:
            break
        if encoding == "cp932" and not _KANJI.fullmatch(re.sub(r"[\x00-\x7f]", "", text)):
            continue
        if encoding != "utf-8-sig":
            assumed.append(f"the text is not UTF-8; it was read as {encoding}")
        return text
    raise ValueError(f"{path} is no text; save it as CSV in UTF-8")


def _actual(line: str) -> str:
    """x,y,z,i,j,k of a line of PC-DMIS that holds what was measured; others as a comment."""
    found = re.match(r"\s*ACTL/(.*)", line)
    return found[1].replace("<", "").replace(">", "") if found else f"# {line}" if line else line


def _named(line: str) -> str:
    """x,y,z of a line that names each of its numbers; the line itself where it does not."""
    found: dict[str, str] = {}
    for name, value in _NAMED.findall(line):
        found.setdefault(name.lower(), value)
    return ",".join(found[axis] for axis in "xyz") if len(found) == 3 else line


def _code(line: str) -> dict[str, str] | None:
    """Words of a line of G-code by their letters, None where it moves along no axis."""
    text = re.sub(r"\([^)]*\)|;.*", "", line).strip()
    words = dict(_CODE.findall(text.upper()))
    moves = bool({"X", "Y", "Z"} & words.keys())
    return words if moves and _BESIDE.fullmatch(_CODE.sub(" ", text)) else None


def _modal(lines: list[str]) -> list[str]:
    """x,y,z of each move at a feed; a coordinate that a line leaves out stays as it is."""
    place: dict[str, str] = {}
    code, told = "1", []
    for line in lines:
        words = _code(line)
        if words is None:
            told.append(f"# {line}")
            continue
        place |= {axis: value for axis, value in words.items() if axis in "XYZ"}
        code = words.get("G", code).lstrip("0") or "0"
        known = code not in ("0", "53") and len(place) == 3
        told.append(",".join(place[axis] for axis in "XYZ") if known else f"# {line}")
    return told
