"""Option records as nested tables and back: for files, for flags, and for names of folders."""

import difflib
import re
import tomllib
from dataclasses import asdict, fields, is_dataclass, replace
from pathlib import Path
from types import UnionType
from typing import Any, NamedTuple, Union, get_args, get_origin, get_type_hints


class Option(NamedTuple):
    """One option: its path, its type, its value in the record asked, and what it means."""

    path: tuple[str, ...]
    kind: type
    value: Any
    meaning: str

    @property
    def name(self) -> str:
        """The path as TOML writes it."""
        return ".".join(self.path)


def options_of(record, path: tuple[str, ...] = ()) -> list[Option]:
    """All options of a record, with those of the records in it.

    Parameters
    ----------
    record : dataclass
        With a numpydoc docstring, from which the meanings are taken.
    """
    found, meanings = [], _meanings(type(record).__doc__ or "")
    hints = get_type_hints(type(record))
    for field in fields(record):
        value, here = getattr(record, field.name), (*path, field.name)
        if is_dataclass(value):
            found += options_of(value, here)
        else:
            meaning = meanings.get(field.name, "")
            found.append(Option(here, _kind(hints[field.name]), value, meaning))
    return found


def flag_of(name: str) -> str:
    """The flag of an option; the name of a kind is the flag of its record: --planner random. Where
    the surface is wanted is a question of its own, whoever plans.

    >>> flag_of("max_touches"), flag_of("planner.name"), flag_of("planner.region")
    ('--max-touches', '--planner', '--region')
    """
    if name in ("planner.region", "planner.elsewhere", "planner.feature"):
        name = name.removeprefix("planner.")
    return "--" + name.removesuffix(".name").replace("_", "-")


def updated(record, table: dict, source: str, path: tuple[str, ...] = ()):
    """A record with the values of a nested table in place of its own.

    Raises
    ------
    ValueError
        In one sentence with the source: an option that there is not, a value of another type, or
        one that the record refuses.
    """
    hints = get_type_hints(type(record))
    new = {}
    for key, value in table.items():
        name = ".".join((*path, key))
        if key not in hints:
            near = difflib.get_close_matches(key, hints, 1)
            hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(hints)}"
            raise ValueError(f"{source} has {name}, which is no option; {hint}")
        if is_dataclass(inner := getattr(record, key)):
            given = _as_options(inner, value, f"{source} has {name}")
            new[key] = updated(inner, given, source, (*path, key))
        else:
            new[key] = _typed(value, _kind(hints[key]), f"{source}: {name}")
    return replace(record, **new)


def _as_options(record, value, what: str) -> dict:
    """A table of options; text is the name of the kind, as that of a flag is."""
    named = any(field.name == "name" for field in fields(record))
    if named and isinstance(value, str):
        return {"name": value}
    if not isinstance(value, dict):
        also = ", or text, its name" if named else ""
        raise ValueError(f"{what} = {value!r}; it must be a table of options{also}")
    return value


def read_options(path, record, ignored: tuple[str, ...] = ()):
    """A record with the values of a TOML file in place of its own.

    Parameters
    ----------
    path : path-like
    record : dataclass
    ignored : tuple of str
        Keys of the file that belong to something else.

    Raises
    ------
    ValueError
        In one sentence: no file, no TOML, an option that there is not, or a wrong value.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} is no file; give a TOML file of options, as run.toml is one")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} cannot be read as TOML ({error}); correct it") from None
    try:
        return updated(record, {k: v for k, v in table.items() if k not in ignored}, str(path))
    except ValueError as error:
        own = str(error).startswith(str(path))
        raise error if own else ValueError(f"{path}: {error}") from None


def nested(flat: dict[tuple[str, ...], Any]) -> dict:
    """A nested table of values by their paths.

    >>> nested({("a",): 1, ("b", "c"): 2})
    {'a': 1, 'b': {'c': 2}}
    """
    table: dict = {}
    for (*outer, last), value in flat.items():
        inner = table
        for key in outer:
            inner = inner.setdefault(key, {})
        inner[last] = value
    return table


def flattened(table: dict, path: tuple[str, ...] = ()) -> dict[str, Any]:
    """A nested table as one with dotted names.

    >>> flattened({"a": 1, "b": {"c": 2}})
    {'a': 1, 'b.c': 2}
    """
    found: dict[str, Any] = {}
    for key, value in table.items():
        inner = (*path, key)
        found |= flattened(value, inner) if isinstance(value, dict) else {".".join(inner): value}
    return found


def differences(record, other) -> dict[str, Any]:
    """The options in which a record differs from another of its kind, by their names."""
    theirs = {option.path: option.value for option in options_of(other)}
    return {o.name: o.value for o in options_of(record) if o.value != theirs[o.path]}


def as_table(record) -> dict:
    """A record as a nested table."""
    return asdict(record)


def _typed(value, kind: type, what: str):
    """A value of a file as the type of its option; nothing is rounded."""
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise ValueError(f"{what} is too large for a number") from None
    if type(value) is kind:
        return value
    words = {int: "a whole number", float: "a number", bool: "true or false", str: "text"}
    raise ValueError(f"{what} is {value!r}; it must be {words.get(kind, kind.__name__)}")


def _kind(hint) -> type:
    """The type of an option that may be left out."""
    if get_origin(hint) in (Union, UnionType):
        return next(kind for kind in get_args(hint) if kind is not type(None))
    return hint


def _meanings(doc: str) -> dict[str, str]:
    """Names of the parameters of a numpydoc docstring, and what is said of each."""
    section = re.search(r"\n *Parameters\n *-+\n(.*?)(?=\n *\w+\n *-+\n|\Z)", doc, re.DOTALL)
    lines = section[1].splitlines() if section else []
    margin = min((len(line) - len(line.lstrip()) for line in lines if line.strip()), default=0)
    found: dict[str, str] = {}
    names: list[str] = []
    for line in lines:
        if line[margin:].startswith(" "):
            for name in names:
                found[name] = f"{found[name]} {line.strip()}".strip()
        elif line.strip():
            names = [name.strip() for name in line.partition(" : ")[0].split(",")]
            found |= dict.fromkeys(names, "")
    return found
