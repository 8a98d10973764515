"""Checks of records of options, each of which ends in one sentence."""

from dataclasses import fields

import numpy as np

from touchatlas.patch.geometry.arrays import real


def check_type(name: str, value, needed: type) -> None:
    """ValueError for an argument that is of another type than it is needed to be."""
    if not isinstance(value, needed):
        got, article = type(value).__name__, "an" if needed.__name__[0] in "AEIO" else "a"
        raise ValueError(f"{name} is of type {got}; give {article} {needed.__name__}")


def names_of(record) -> tuple[str, ...]:
    """Names of the fields of a record."""
    return tuple(field.name for field in fields(record))


def check_above(record, positive: tuple[str, ...] = (), names: tuple[str, ...] = ()) -> None:
    """ValueError for a field, of all or of some names, that is no finite number, 0 or more, or more
    than 0; one whose default is None may be None."""
    for field in fields(record):
        name, value = field.name, getattr(record, field.name)
        if (names and name not in names) or (value is None and field.default is None):
            continue
        if not (0.0 <= real(value) < np.inf and (value > 0.0 or name not in positive)):
            need = "more than 0" if name in positive else "0 or more"
            raise ValueError(f"{name} is {value!r}; it must be a finite number, {need}")


def check_whole(record, name: str, least: int, most: float) -> None:
    """ValueError for a field that is no whole number from the least to the most, which may be
    infinite."""
    value = getattr(record, name)
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (whole and least <= value <= most):
        need = f" from {least} to {most}" if most < np.inf else f", {least} or more"
        raise ValueError(f"{name} is {value!r}; it must be a whole number{need}")
