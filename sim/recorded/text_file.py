"""A text file as lines, in one kind of minus, and of one point a line.

Lines of controls hold points among words: grbl's ``[PRB:x,y,z:1]``, ``GOTO/x,y,z``, words of
G-code, ``x: 1`` under each other as topics are echoed, ``"x": 1`` as in JSON. Each becomes a line
of cells.
"""

import re
from dataclasses import dataclass
from pathlib import Path

NUMBER = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?"
_MINUS = str.maketrans(dict.fromkeys("\u2212\u2010\u2011\u2013\uff0d", "-") | {"\u3000": " "})
_KANJI = re.compile(r"[\u3040-\u30ff\u4e00-\u9fff\uff01-\uff5e\u3000-\u303f]*")
_N = r"\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)\s*"
# A point amid a line: its pattern, how it is written, what its parts are, and the writer's unit.
_AMID = (
    (r"\[PRB:([^,]*),([^,]*),([^,:]*)[^:\]]*:([01])\]", "[PRB:x,y,z:hit]", "x y z hit", ""),
    (rf"probe at{_N},{_N}is z={_N}", "probe at x,y is z=", "x y z", ""),
    (rf"robtarget\b.*?\[\s*\[{_N},{_N},{_N}\]", "the positions of robtarget", "x y z", "mm"),
)
_SLASHED = re.compile(rf"\s*(?!THEO|TARG)[A-Z]+/\s*<?({_N}(?:,{_N}){{2,}}.*)")
_NAMED = re.compile(rf'\b([xyzijk])"?\s*[:=]?\s*"?{_N[3:-3]}(?:\s*(mm|cm|in|m)\b)?', re.IGNORECASE)
_BARE = re.compile(rf"\s*{NUMBER}(?:[\s,;]+{NUMBER}){{2,}}\s*")
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
    text = text_of(path, assumed)
    if _ECHOED.search(text):
        assumed.append("x:, y:, z: on lines that follow each other are one point")
        text = _ECHOED.sub(r"\1 \2 \3\n\n", text)
        return Lines(_split(text), ["x", "y", "z"], assumed)
    if text.count("\n") < 3:
        # A list of lists or of objects, as JSON writes it.
        text = re.sub(r"([\]}])\s*,\s*([\[{])", r"\1\n\2", text)
    text = re.sub(r"(\d\.\d*)[dD]([+-]\d+)", r"\1e\2", text)
    lines = _split(text)
    if path.suffix.lower() == ".ptx":
        # Sizes, and where the scanner stood.
        lines[:10] = [f"# {line}" for line in lines[:10]]
    for pattern, words, names, unit in _AMID:
        if re.search(pattern, text):
            found = [re.search(pattern, line) for line in lines]
            assumed.append(f"{words} are points")
            told = [",".join(m.groups()) if m else w for m, w in zip(found, lines, strict=True)]
            return Lines(told, names.split(), assumed, unit)
    found = [_SLASHED.match(line) for line in lines] if "/" in text else []
    if any(found) and 2 * sum(map(bool, found)) > sum(map(bool, map(_BARE.fullmatch, lines))):
        word = next(m for m in found if m)[0].partition("/")[0].strip()
        assumed.append(f"{word}/ are points")
        told = [
            re.sub("[<>]", "", m[1]) if m else _comment(line)
            for m, line in zip(found, lines, strict=True)
        ]
        return Lines(told, None, assumed)
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
    named = [_named(line) if "z" in line.lower() else None for line in lines]
    points = [point for point in named if point]
    if points and len(points) > sum(map(bool, map(_BARE.fullmatch, lines))):
        axes = "xyz" + "ijk" * all("k" in point for point in points)
        assumed.append(f"numbers after {', '.join(axes)} are coordinates")
        told = [
            ",".join(point.get(axis, "") for axis in axes) if point else _comment(line)
            for point, line in zip(named, lines, strict=True)
        ]
        return Lines(told, list(axes), assumed, points[0].get("unit", ""))
    units = [[found[1] for found in _WITH_UNIT.findall(line)] for line in full]
    if 2 * sum(len(found) >= 3 for found in units) > len(full):
        unit = next(found[-1] for found in units if found)
        assumed.append(f"{unit} stands after each number")
        return Lines([_WITH_UNIT.sub(r"\1", line) for line in lines], None, assumed, unit)
    return Lines(lines, None, assumed)


def _split(text: str) -> list[str]:
    return re.split(r"\r\n|\r|\n", text)


def text_of(path: Path, assumed: list[str]) -> str:
    """The text of a file, in one kind of minus: Unicode, else Japanese where all special letters
    are, else Western. What was assumed is added to the list."""
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
        return text.translate(_MINUS)
    raise ValueError(f"{path} is no text; save it as CSV in UTF-8")


def _named(line: str) -> dict[str, str] | None:
    """The numbers of a line that names x, y, z, and perhaps i, j, k, by their names, and the unit
    after them; None where it does not."""
    found: dict[str, str] = {}
    for name, value, unit in _NAMED.findall(line):
        found.setdefault(name.lower(), value)
        if unit:
            found["unit"] = unit
    return found if {*"xyz"} <= found.keys() else None


def _comment(line: str) -> str:
    """A line that holds no point, marked as such; an empty one as it is."""
    return f"# {line}" if line.strip() else line


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
            told.append(_comment(line))
            continue
        place |= {axis: value for axis, value in words.items() if axis in "XYZ"}
        code = words.get("G", code).lstrip("0") or "0"
        known = code not in ("0", "53") and len(place) == 3
        told.append(",".join(place[axis] for axis in "XYZ") if known else _comment(line))
    return told
