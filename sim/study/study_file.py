"""STUDY.toml: which objects are explored with which options and seeds, and what is compared."""

import difflib
import re
import tomllib
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import trimesh

from touchatlas.sim.folder.option_tables import flag_of, flattened, nested, options_of, updated
from touchatlas.sim.folder.run_options import RunOptions
from touchatlas.sim.study.cells import Cell
from touchatlas.sim.study.workers import WorkOptions
from touchatlas.sim.world.objects import file_digest, make_object, object_names

_KEYS = {
    "objects": "names, mesh files, folders and patterns as parts/*.stl",
    "seeds": 'a number of seeds, a range as "10-19", or a list',
    "options": "a table of flags of touchatlas explore, the same for all runs",
    "vary": "a table of flags, each with a list of values: every value with every other",
    "baseline": "a table of one value for some flags of vary, that others are compared with",
    "limits": "a table of seconds and gigabytes of a run",
    "table": '"csv" or "parquet"',
}
_LIMITS = {"seconds": "cell_seconds", "gigabytes": "cell_gigabytes"}
_OF_DIAGONAL = re.compile(r"([0-9.eE+-]+) *(?:of the )?diagonals?")


@dataclass(frozen=True, eq=False)
class StudyFile:
    """What a STUDY.toml says.

    Parameters
    ----------
    name : str
    sources : list of str
        Names of objects, and paths of mesh files.
    seeds : list of int
    fixed : dict
        Values of options by their dotted names, the same for all runs.
    varied : dict of str to dict
        For each flag that varies, as it is written: the values by their words.
    paths : dict of str to str
        The dotted name of the option of each such flag.
    baseline : dict of str to str
        Words of the values that others are compared with.
    work : WorkOptions
        Limits of a run.
    table : str
    """

    name: str
    sources: list[str]
    seeds: list[int]
    fixed: dict[str, Any]
    varied: dict[str, dict[str, Any]]
    paths: dict[str, str]
    baseline: dict[str, str]
    work: WorkOptions
    table: str

    def settings(self) -> list[dict[str, str]]:
        """Every value with every other, in words."""
        return [
            dict(zip(self.varied, words, strict=True)) for words in product(*self.varied.values())
        ]

    def cells(self) -> list[Cell]:
        """A cell of each object, setting and seed."""
        digests = {s: file_digest(s) if Path(s).is_file() else "" for s in self.sources}
        names = named(self.sources)
        found = []
        for source, setting, seed in product(self.sources, self.settings(), self.seeds):
            values = {self.paths[flag]: self.varied[flag][word] for flag, word in setting.items()}
            table, fractions = split(self.fixed | values)
            head = {"object": names[source]} | setting | {"seed": str(seed)}
            given = (source, digests[source], table, fractions, seed)
            found.append(Cell(f"runs.{self.table}", head, given))
        return found


def split(values: dict[str, Any]) -> tuple[dict, dict[str, float]]:
    """A nested table of options, and those that are fractions of the diagonal.

    >>> split({"tolerance": "1e-3 of the diagonal", "planner.name": "random"})
    ({'planner': {'name': 'random'}}, {'tolerance': 0.001})
    """
    fractions = {}
    for name, value in values.items():
        found = _OF_DIAGONAL.fullmatch(value) if isinstance(value, str) else None
        if found:
            fractions[name] = float(found[1])
    rest = {tuple(k.split(".")): v for k, v in values.items() if k not in fractions}
    return nested(rest), fractions


def named(sources: list[str]) -> dict[str, str]:
    """A name of each source in tables: its own, or that of its file; its path where that is
    another's, too."""
    stems = {source: Path(source).stem if Path(source).is_file() else source for source in sources}
    names = list(stems.values())
    return {s: name if names.count(name) == 1 else s for s, name in stems.items()}


def read_study(path) -> StudyFile:
    """The study of a file.

    Raises
    ------
    ValueError
        In one sentence: what was got, what is needed, and what to try.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} is no file; give a TOML file that says what to explore")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} cannot be read as TOML ({error}); correct it") from None
    for key in table:
        _known(path, key, list(_KEYS))
    options, vary = _table(path, table, "options"), _table(path, table, "vary")
    fixed = {_option(path, f"options.{flag}", flag): value for flag, value in options.items()}
    paths = {flag: _option(path, f"vary.{flag}", flag) for flag in vary}
    varied = {flag: _values(path, flag, given) for flag, given in vary.items()}
    for flag, name in paths.items():
        if name in fixed or list(paths.values()).count(name) > 1:
            raise ValueError(f"{path} gives {flag} twice; leave one of them out")
    study = StudyFile(
        *(path.stem, _sources(path, table), _seeds(path, table), fixed, varied, paths),
        *(_baseline(path, table, varied), _limits(path, table), _format(path, table)),
    )
    _check(path, study)
    return study


def _known(path: Path, key: str, names: list[str], where: str = "") -> None:
    if key not in names:
        near = difflib.get_close_matches(key, names, 1)
        hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(names)}"
        raise ValueError(f"{path} has {where}{key}, which is no key of a study; {hint}")


def _table(path: Path, table: dict, key: str) -> dict:
    """A table by dotted names, however it is written: probe.name is that of a table probe, too."""
    found = table.get(key, {})
    if not isinstance(found, dict):
        raise ValueError(f"{path}: {key} is {found!r}; it must be {_KEYS[key]}")
    return flattened(found)


def _option(path: Path, where: str, flag: str) -> str:
    """The dotted name of the option that a flag, or its own name, says."""
    found: dict[str, str] = {}
    for option in options_of(RunOptions()):
        words = flag_of(option.name).removeprefix("--")
        found |= {words: option.name, words.replace("-", "_"): option.name}
        found[option.name] = option.name
    found.pop("seed")
    name = found.get(flag.removeprefix("--"))
    if name is None:
        if flag.removeprefix("--") == "seed":
            raise ValueError(f"{path} has {where}; give seeds = [...] beside it instead")
        near = difflib.get_close_matches(flag, found, 1)
        hint = f"did you mean {near[0]}?" if near else "touchatlas explore --help lists them"
        raise ValueError(f"{path} has {where}, which is no flag of touchatlas explore; {hint}")
    return name


def _values(path: Path, flag: str, given) -> dict[str, Any]:
    if not isinstance(given, list) or not given:
        raise ValueError(
            f"{path}: vary.{flag} is {given!r}; it must be a list of one value or more"
        )
    found = {str(value): value for value in given}
    if len(found) < len(given):
        raise ValueError(f"{path}: vary.{flag} is {given!r}; leave out what is there twice")
    return found


def _sources(path: Path, table: dict) -> list[str]:
    """Names and absolute paths; those of a file are beside it."""
    given = table.get("objects")
    if not isinstance(given, list) or not given or not all(isinstance(g, str) for g in given):
        raise ValueError(f"{path}: objects is {given!r}; it must be a list of {_KEYS['objects']}")
    found: list[str] = []
    for one in given:
        if one in object_names():
            found.append(one)
            continue
        place = path.parent / one
        files = sorted(place.parent.glob(place.name)) if "*" in one else [place]
        if place.is_dir():
            files = sorted(p for p in place.iterdir() if _is_mesh(p))
        files = [file for file in files if file.is_file()]
        if not files:
            near = difflib.get_close_matches(one, object_names(), 1)
            hint = f"did you mean {near[0]}?" if near else "touchatlas objects lists the names"
            raise ValueError(
                f"{path}: {one!r} of objects is neither a built-in object nor a mesh file, or "
                f"folder of such, beside {path.name}; {hint}"
            )
        found += [str(file.resolve()) for file in files]
    return list(dict.fromkeys(found))


def _is_mesh(path: Path) -> bool:
    formats = {*trimesh.available_formats(), "step", "stp"}
    return path.is_file() and path.suffix.lower().lstrip(".") in formats


def _seeds(path: Path, table: dict) -> list[int]:
    given, found = table.get("seeds", 1), None
    if isinstance(given, str) and (ends := re.fullmatch(r"(\d+) *- *(\d+)", given)):
        found = list(range(int(ends[1]), int(ends[2]) + 1))
    elif isinstance(given, int) and not isinstance(given, bool):
        found = list(range(given))
    elif isinstance(given, list) and all(type(seed) is int and seed >= 0 for seed in given):
        found = list(dict.fromkeys(given))
    if not found:
        raise ValueError(f"{path}: seeds is {given!r}; it must be {_KEYS['seeds']}")
    return found


def _baseline(path: Path, table: dict, varied: dict[str, dict[str, Any]]) -> dict[str, str]:
    found = {}
    for flag, value in _table(path, table, "baseline").items():
        values = varied.get(flag, {})
        if str(value) not in values:
            known = ", ".join(f"{name} = {words}" for name in varied for words in varied[name])
            raise ValueError(
                f"{path}: baseline.{flag} is {value!r}; it must be one that vary has: "
                f"{known or 'give a table [vary]'}"
            )
        found[flag] = str(value)
    return found


def _limits(path: Path, table: dict) -> WorkOptions:
    given = _table(path, table, "limits")
    for key, value in given.items():
        _known(path, key, list(_LIMITS), "limits.")
        if not isinstance(value, int | float) or isinstance(value, bool) or not value > 0:
            raise ValueError(f"{path}: limits.{key} is {value!r}; it must be a number > 0")
    seconds, gigabytes = (float(given[k]) if k in given else None for k in _LIMITS)
    return WorkOptions(cell_seconds=seconds, cell_gigabytes=gigabytes)


def _format(path: Path, table: dict) -> str:
    given = table.get("table", "csv")
    if given not in ("csv", "parquet"):
        raise ValueError(f"{path}: table is {given!r}; it must be {_KEYS['table']}")
    return given


def _check(path: Path, study: StudyFile) -> None:
    """Refuse options that no run can have; of a built-in object all, of a file those of any."""
    from touchatlas.sim.study.course import options_of_run

    objects = [make_object(s) for s in study.sources if not Path(s).is_file()]
    for setting in study.settings():
        values = {study.paths[flag]: study.varied[flag][word] for flag, word in setting.items()}
        table, fractions = split(study.fixed | values)
        words = ", ".join(f"{flag} = {word}" for flag, word in setting.items())
        try:
            updated(RunOptions(), table, str(path))
            for name in fractions:
                _of_length(name)
        except ValueError as error:
            start = "" if str(error).startswith(str(path)) else f"{path}: "
            raise ValueError(f"{start}{error}{f' (with {words})' if words else ''}") from None
        for obj in objects:
            try:
                options_of_run(table, fractions, 0, obj)
            except ValueError as error:
                where = ", ".join(part for part in (obj.name, words) if part)
                raise ValueError(f"{path}: {error} (in {where})") from None


def _of_length(name: str) -> None:
    if name not in ("noise", "tolerance", "max_length"):
        raise ValueError(
            f"{name} is a fraction of the diagonal; only noise, tolerance and max_length can be"
        )


def with_limits(study: StudyFile, work: WorkOptions) -> WorkOptions:
    """Options of the command line, with limits of the file where the command gives none."""
    own = {name: getattr(study.work, name) for name in _LIMITS.values()}
    given = {name: getattr(work, name) for name in own}
    limits = {n: given[n] if given[n] is not None else own[n] for n in own}
    return replace(work, **limits)
