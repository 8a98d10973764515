"""Flags of a command, made from an option record: one for each field, and a TOML file of them."""

import inspect
import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from touchatlas.sim.folder.option_tables import (
    Option,
    flag_of,
    nested,
    options_of,
    read_options,
    updated,
)


def whole(_type, tokens) -> int:
    """The integer that was written; cyclopts itself would round 1.5."""
    text = tokens[0].value
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"{text!r} is no whole number") from None


Whole = Annotated[int, Parameter(converter=whole)]


def with_options(record, ignored: tuple[str, ...]) -> Callable:
    """A decorator: the command's argument ``options`` is made from a record, a file and flags.

    Parameters
    ----------
    record : dataclass
        The defaults. Each of its fields, and of the records in it, becomes a flag.
    ignored : tuple of str
        Keys of a file of options that belong to something else.
    """
    listed = {"_".join(option.path): option for option in options_of(record)}

    def decorate(command: Callable) -> Callable:
        @wraps(command)
        def with_flags(*arguments, options: Path | None = None, **others):
            found = {listed[name].path: others.pop(name, None) for name in listed}
            given = {path: value for path, value in found.items() if value is not None}
            base = record if options is None else read_options(options, record, ignored)
            return command(*arguments, options=updated_by_flags(base, given), **others)

        old = inspect.signature(command).parameters
        flags = [p for name, p in old.items() if name != "options"]
        flags.append(_flag("options", Path, "A TOML file of options, as run.toml is one."))
        flags += [_flag(name, option, option.meaning) for name, option in listed.items()]
        with_flags.__signature__ = inspect.Signature(flags)  # type: ignore[attr-defined]
        with_flags.__annotations__ = {p.name: p.annotation for p in flags} | {"return": int}
        return with_flags

    return decorate


def updated_by_flags(base, given: dict[tuple[str, ...], Any]):
    """A record with the values of flags; what it refuses names the flags."""
    try:
        return updated(base, nested(given), "the command")
    except ValueError as error:
        # A record begins with the names of what it refuses: "step, reach are 3, 1; ...".
        names, verb, rest = (re.split(r" (is|are) ", str(error), maxsplit=1) + [""] * 2)[:3]
        # Records have names in common: that with the value is meant, else that which was given.
        paths = [option.path for option in options_of(base)] + list(given)
        paths += [path for path, value in given.items() if rest.startswith(f"{value!r};")]
        flags = {path[-1]: flag_of(".".join(path)) for path in paths}
        keys = [name.replace("-", "_") for name in names.split(", ")]
        if not (given and verb and all(key in flags for key in keys)):
            raise
        raise ValueError(f"{', '.join(flags[key] for key in keys)} {verb} {rest}") from None


def _flag(name: str, option: Option | type, meaning: str) -> inspect.Parameter:
    """A keyword argument that is None unless the flag is given."""
    kind, flag, default = option, f"--{name}", ""
    if isinstance(option, Option):
        kind, flag = option.kind, flag_of(option.name)
        if option.value is not None:
            value = f"{option.value:.5g}" if option.kind is float else option.value
            default = f" (default {value})"
    about: dict[str, Any] = {"name": flag, "help": meaning + default, "show_default": False}
    if kind is int:
        about["converter"] = whole
    annotation = Annotated[kind | None, Parameter(**about)]  # type: ignore[valid-type]
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation
    )
