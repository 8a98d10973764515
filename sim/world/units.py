"""Units of length as files write them."""

import re

_NAMES = {
    "nm": "nm nanometer nanometers nanometre",
    "um": "um µm μm micron microns micrometer micrometers micrometre",
    "mm": "mm millimeter millimeters millimetre millimetres millimètres metric metrisch ミリ",
    "cm": "cm centimeter centimeters centimetre centimetres",
    "dm": "dm decimeter decimetre",
    "m": "m meter meters metre metres mètre mètres metro metri metros メートル",
    "in": "in inch inches zoll pouce pouces pollici pulgada pulgadas english インチ",
    "ft": "ft foot feet",
    "mil": "mil mils thou",
}
UNITS = {name: unit for unit, names in _NAMES.items() for name in names.split()}
UNIT_NAMES = f"{', '.join([*_NAMES][:-1])} or {[*_NAMES][-1]}"
# Millimetres in each.
MILLIMETRES = {
    "nm": 1e-6,
    "um": 1e-3,
    "mm": 1.0,
    "cm": 10.0,
    "dm": 100.0,
    "m": 1e3,
    "in": 25.4,
    "ft": 304.8,
    "mil": 0.0254,
}
_SHORT = "nm|um|µm|μm|mm|cm|dm|m|inch|in|ft|mil|micron"
_IN_BRACKETS = re.compile(r"[\[({<]\s*([^\])}>]*?)\s*[\])}>]")
_TAIL = re.compile(rf"[\s_/.-]({_SHORT})$", re.IGNORECASE)
_SAID = re.compile(
    r"(?:\b(?:length[ _]?)?units?\b|\beinheit(?:en)?\b|\bunit[éeà]s?\b|\bunità\b|\bunidad(?:es)?\b|"
    r"単位|\blengths?\s+(?:are\s+)?in\b)\W*(?:are\W+|is\W+|in\W+)?([^\W\d_]+)",
    re.IGNORECASE,
)


def unit_of(name: str) -> tuple[str, str]:
    """A name of a column without its unit, and the unit, "" where it has none.

    >>> unit_of("x [Millimeter]"), unit_of("pos_x_m"), unit_of("pos[0]")
    (('x ', 'mm'), ('pos_x', 'm'), ('pos[0]', ''))
    """
    match = _IN_BRACKETS.search(name)
    if match and (unit := UNITS.get(match[1].lower())):
        return name[: match.start()] + name[match.end() :], unit
    match = _TAIL.search(name)
    if match:
        return name[: match.start()], UNITS[match[1].lower()]
    return name, ""


def said_unit(lines: list[str]) -> str:
    """The unit that lines of words name, "" where none does.

    >>> said_unit(["UNITS/MM,ANGDEC"]), said_unit(["# lengths in metres"]), said_unit(["G20"])
    ('mm', 'm', 'in')
    """
    for line in lines:
        for match in _SAID.finditer(line):
            if unit := UNITS.get(match[1].lower()):
                return unit
        if re.search(r"\b(METRIC|G21)\b|\bBEGIN PGM \S+ MM\b", line):
            return "mm"
        if re.search(r"\b(ENGLISH|INCH|G20)\b", line):
            return "in"
    return ""


def millimetre_of(unit: str, diagonal: float) -> float:
    """A millimetre in a unit, length; where it has no name, in one in which something as large as a
    hand, 200 mm, has a diagonal.

    >>> millimetre_of("m", 0.3), millimetre_of("", 50.0)
    (0.001, 0.25)
    """
    return 1.0 / MILLIMETRES[unit] if unit in MILLIMETRES else diagonal / 200.0
