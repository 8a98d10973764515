"""Which column is what, by its name: as people, machines and robots write it, with its unit.

Coordinates are three names that differ by x, y, z in one place, or by three successive numbers.
"""

import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from touchatlas.sim.recorded.table_file import Table
from touchatlas.sim.world.units import unit_of

COORDINATES = ("x", "y", "z")
VECTOR = ("nx", "ny", "nz")
WANTED = "the columns curve, x, y, z (and nx, ny, nz if known)"
# Words of the names of columns: English, German, French, Italian, Spanish, Japanese.
CURVE_WORDS = re.findall(
    r"\w+",
    "curve contour line scan section profile track trace path polyline segment group stroke "
    "element feature cloud layer slice level "
    "kurve bahn kontur linie spur profil schnitt courbe ligne coupe trajet trajectoire curva linea "
    "profilo sezione percorso traiettoria contorno perfil seccion trayectoria "
    "曲線 輪郭 線 断面 要素 軌跡 id name",
)
_FLAG_WORDS = (
    "trigger(ed)?|valid|ok|hit|contact|touch(ed)?|state|status|success|good|probed?|tripped|"
    "gultig|gueltig|beruhrt|kontakt|valide|valido|contatto|contacto|有効|接触"
)
_FAIL_WORDS = "err(or)?|fail(ed|ure)?|miss(ed)?|bad|outlier|fehler|erreur|errore|エラー"
_TIME_WORDS = (
    "time|timestamp|stamp|sec|secs|nsec|nanosec|nsecs|zeit|zeitstempel|temps|tempo|tiempo|"
    "時間|時刻|t"
)
# Kinds of coordinates, by words in their names without x, y, z; the first that is found counts.
_NO_PLACE = (
    r"q|quat\w*|orient\w*|rot\w*|euler|rpy|vel\w*|speed|acc\w*|force|torque|ft|wrench|moment|gyro\w*|"
    r"mag|imu|joint\w*|angular|effort|twist|std|sigma|cov\w*|var|dev\w*|abw\w*|ecart|scarto|"
    r"desviacion|err\w*|diff|delta|residual|colou?r|rgb|scale|current|offset|偏差"
)
_NOMINAL = (
    "nom|nominal|nominale|soll|sollwert|target|theo|theor|theoretical|ideal|desired|command|"
    "commanded|cmd|goal|ref|reference|cad|consigne|teorico|nominel|nennwert|設計|公称|目標"
)
_ACTUAL = (
    "act|actual|meas|measured|ist|istwert|gemessen|messwert|mes|mesure|mis|misurato|med|medido|"
    "effettivo|real|reel|実測|測定"
)
_PLACE = (
    "|pos|position|p|pt|point|punkt|punto|coord|coordinate|coordinates|koordinate|coordonnee|"
    "coordinata|coordenada|contact|t|translation|trans|loc|location|pose|tcp|ee|eef|flange|tool|"
    "tip|probe|xyz|center|centre|mittelpunkt|座標|位置"
)
_VECTOR = (
    "n|normal|normals|normale|normalen|planenormal|planen|plane|ebene|vec|vector|vektor|ijk|dir|"
    "direction|richtung|approach|antast|antastrichtung|法線|方向"
)


@dataclass
class Columns:
    """The places of columns, the unit that their names hold, and what the curves are named by.

    ``flag`` holds the place of a flag of points and whether 1 means good.
    """

    xyz: tuple[int, ...]
    vector: tuple[int, ...] = ()
    curve: int | None = None
    flag: tuple[int, bool] | None = None
    time: int | None = None
    unit: str = ""
    names: list[str] = field(default_factory=list)
    poses: bool = False


@dataclass(frozen=True)
class Triple:
    """Three columns whose names differ by x, y, z: their places, and their name without these."""

    places: tuple[int, ...]
    words: str

    @property
    def kind(self) -> str:
        """vector, none, nominal, actual, place, or other."""
        words = re.findall(r"[a-z]+|[\u3040-\u30ff\u4e00-\u9fff]+", self.words)
        kinds = (
            ("vector", _VECTOR),
            ("none", _NO_PLACE + ("|v|f|r|w|a|m|d|s" if len(words) == 1 else "")),
            ("nominal", _NOMINAL),
            ("actual", _ACTUAL),
            ("place", _PLACE),
        )
        if not words:
            return "plain"
        for kind, known in kinds:
            every = all if kind in ("vector", "place") else any
            if every(re.fullmatch(known, word) for word in words):
                return kind
        return "other"


def columns_by_name(path, table: Table) -> Columns | None:
    """Which column is what by the row of names above the points; None where there is no such row.

    Raises
    ------
    ValueError
        In one sentence: a coordinate is missing or there twice, or coordinates differ in unit.
    """
    rows = [row for row in table.above if not _are_units(row)]
    if not rows:
        return None
    # Names may be in rows under each other, as of markers and their coordinates.
    joined = [" ".join(filter(None, parts)) for parts in zip(*rows[::-1], strict=True)]
    held = [row for row in (*rows, joined) if _best(_triples(_read_row(row)[1]))]
    names, cleaned, units = _read_row(held[0] if held else rows[0])
    found = _triples(cleaned)
    triple = _best(found)
    if triple is None:
        _refuse_missing(path, table, names, cleaned)
        return None
    for place in triple.places:
        if cleaned.count(cleaned[place]) > 1:
            raise ValueError(f"{path} has the column {names[place]} twice; rename one of them")
    vectors = [t for t in found if t.kind == "vector"]
    columns = Columns(triple.places, vectors[0].places if vectors else (), names=names)
    columns.unit = _unit(path, [units[i] for i in triple.places], table.above, triple)
    columns.poses = any(re.search(r"(^|[^a-z])q[_ ]?w$|orientation.*w$", c) for c in cleaned)
    columns.poses |= bool(re.search(r"tcp|pose|t_ee", triple.words))
    _others(table, columns, cleaned)
    if not vectors:
        _refuse_part_of_a_vector(path, cleaned)
    return columns


def triples_of(row: Sequence[str]) -> list[Triple]:
    """Columns of a row of names that differ by x, y, z in one place."""
    return _triples(_read_row(row)[1])


def _read_row(row: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
    """Names as they are, in small letters without accents and units, and the units."""
    names, units = zip(*(unit_of(name) for name in row), strict=True)
    return list(row), [_cleaned(name) for name in names], list(units)


def _cleaned(name: str) -> str:
    """A name in small letters without accents; words that are written together are parted."""
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.strip())
    plain = unicodedata.normalize("NFKD", name.lower())
    return "".join(c for c in plain if not unicodedata.combining(c))


def _triples(names: list[str]) -> list[Triple]:
    """Columns whose names differ by x, y, z, or i, j, k, in one place, or by successive numbers."""
    places = {name: i for i, name in reversed(list(enumerate(names)))}
    found: dict[tuple[int, ...], Triple] = {}
    for i, name in enumerate(names):
        for others, rest in _variants(name):
            if places.get(name) == i and all(other in places for other in others):
                triple = Triple((i, *(places[other] for other in others)), rest)
                found.setdefault(triple.places, triple)
    return list(found.values())


def _variants(name: str) -> Iterator[tuple[tuple[str, str], str]]:
    """What the second and third name of a triple are whose first is this one."""
    for match in re.finditer("x", name):
        head, tail = name[: match.start()], name[match.end() :]
        yield (f"{head}y{tail}", f"{head}z{tail}"), f"{head} {tail}"
    if name in ("i", "u"):
        yield ("jk" if name == "i" else "vw"), "ijk"  # type: ignore[misc]
    for match in re.finditer(r"\d+", name):
        head, tail, k = name[: match.start()], name[match.end() :], int(match[0])
        # Transforms of a robot have sixteen numbers, column by column.
        full = re.search(r"o ?[_ ]?t[_ ]?ee", head) is not None
        if k == 12 if full else k in (0, 1) and re.search("pos|tcp|xyz|coord|ee|trans", head):
            if k == 1 and re.search(r"\b0\b", head):
                continue
            yield (f"{head}{k + 1}{tail}", f"{head}{k + 2}{tail}"), f"{head} {tail}"


def _best(triples: list[Triple]) -> Triple | None:
    """The coordinates: actual ones before plain ones, and these before others."""
    order = ("actual", "plain", "place", "other", "nominal")
    usable = [triple for triple in triples if triple.kind in order]
    return min(usable, key=lambda triple: order.index(triple.kind), default=None)


def _refuse_missing(path, table: Table, names: list[str], cleaned: list[str]) -> None:
    """Refuse names of which some, but not all, are coordinates."""
    missing = [axis for axis in COORDINATES if not any(re.search(axis, c) for c in cleaned)]
    numbers = sum(bool((table.numbers(i) == table.numbers(i)).any()) for i in range(len(names)))
    if len(missing) < 3 or numbers < 3:
        raise ValueError(
            f"{path} has no column {', '.join(missing or COORDINATES)} among "
            f"{', '.join(filter(None, names))}; name the coordinates x, y, z in the first line, or "
            "say which they are, as in --columns x=3,y=4,z=5,curve=1"
        )


def _refuse_part_of_a_vector(path, cleaned: list[str]) -> None:
    part = [name for name in VECTOR if name in cleaned]
    if part and len(part) < 3:
        raise ValueError(f"{path} has {', '.join(part)} only; give all of nx, ny, nz or none")


def _are_units(row: list[str]) -> bool:
    """Whether each cell is a unit, or empty."""
    cells = [cell.strip("[](){} ") for cell in row if cell]
    return bool(cells) and all(unit_of(f"[{cell}]")[1] for cell in cells)


def _unit(path, named: list[str], above: list[list[str]], triple: Triple) -> str:
    """The unit in the names of the coordinates, or in a row of units below them."""
    units = set(named)
    for row in above if units == {""} else ():
        cells = [row[i] for i in triple.places]
        if _are_units(cells):
            units = {unit_of(f"[{cell.strip('[](){} ')}]")[1] for cell in cells}
            break
    if len(units) > 1:
        raise ValueError(
            f"{path} has x, y, z in different units "
            f"({', '.join(unit or 'none' for unit in sorted(units))}); write all in one"
        )
    return units.pop()


def _others(table: Table, columns: Columns, cleaned: list[str]) -> None:
    """Places of the curve, of a flag of points, and of the time."""
    free = [i for i in range(len(cleaned)) if i not in (*columns.xyz, *columns.vector)]
    ranked = []
    for i in free:
        words = re.findall(r"[a-z]+|[\u3040-\u30ff\u4e00-\u9fff]+", cleaned[i])
        if columns.time is None and any(re.fullmatch(_TIME_WORDS, word) for word in words):
            columns.time = i
            continue
        good = any(re.fullmatch(_FLAG_WORDS, word) for word in words)
        bad = any(re.fullmatch(_FAIL_WORDS, word) for word in words)
        if columns.flag is None and (good or bad) and flags(table.columns[i]) is not None:
            columns.flag = (i, not bad)
            continue
        rank = [CURVE_WORDS.index(w) for w in words if w in CURVE_WORDS]
        rank += [k for k, known in enumerate(CURVE_WORDS) if words and words[0] in (f"{known}id",)]
        if not rank and words:
            rank = [k + 100 for k, w in enumerate(CURVE_WORDS) if len(w) > 4 and w in cleaned[i]]
        # One name for all, as of a frame, is no name of a curve, unless its column says so.
        if rank and (min(rank) < CURVE_WORDS.index("element") or len(set(table.columns[i])) > 1):
            ranked.append((min(rank), i))
    if ranked:
        usable = [(rank, i) for rank, i in ranked if not counts_lines(table, i)]
        columns.curve = min(usable or ranked)[1]


_GOOD = {"1", "true", "ok", "yes", "ja", "oui", "si", "hit", "valid", "good", "y", "t", "pass"}
_GOOD |= {"touched", "tracked", "1.0", "contact", "i.o.", "io", "gut", "合格"}
_BAD = {"0", "false", "no", "nein", "non", "miss", "missed", "missing", "fail", "failed", "n", "f"}
_BAD |= {"invalid", "bad", "lost", "error", "ng", "0.0", "", "none", "no contact", "n.i.o.", "nio"}
_BAD |= {"nok", "n.ok", "fehler", "ungultig", "erreur", "errore", "invalide", "非", "不合格"}


def flags(cells: list[str]) -> list[bool] | None:
    """Which cells of a flag say yes; None where one is no flag."""
    words = [cell.strip("\"' ").lower() for cell in cells]
    return [w in _GOOD for w in words] if set(words) <= _GOOD | _BAD else None


def counts_lines(table: Table, place: int) -> bool:
    """Whether a column differs from line to line, as a number of points does and no curve."""
    cells = table.columns[place]
    return 2 * len(set(cells)) > len(cells) > 1
