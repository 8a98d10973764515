"""Rows of studies: as tables, in groups, and their numbers."""

import io
import math
from collections.abc import Iterable
from csv import DictWriter
from typing import Any

import numpy as np

from touchatlas.sim.study.cells import Row

Summed = list[dict[str, Any]]


def table_bytes(file: str, columns: tuple[str, ...], rows: list[Row]) -> bytes:
    """Rows as a table of the kind that a file's name ends with: CSV or Parquet.

    Raises
    ------
    ValueError
        For Parquet without pyarrow.
    """
    if not file.endswith(".parquet"):
        return csv_bytes(columns, rows)
    try:
        from pyarrow import BufferOutputStream
        from pyarrow import table as arrow_table
        from pyarrow.parquet import write_table
    except ImportError:
        raise ValueError(
            'a table in Parquet needs pyarrow; pip install "touchatlas[parquet]"'
        ) from None
    values = {name: _typed([row.get(name, "") for row in rows]) for name in columns}
    stream = BufferOutputStream()
    write_table(arrow_table(values), stream)
    return stream.getvalue().to_pybytes()


def _typed(texts: list[str]) -> list:
    """A column of text as numbers, with None where it is blank; as it is where it holds words."""
    for kind in (int, float):
        try:
            return [kind(text) if text else None for text in texts]
        except ValueError:
            pass
    return texts


def csv_bytes(columns: tuple[str, ...], rows: Iterable[dict]) -> bytes:
    """Rows as a table; blank where a column is missing."""
    text = io.StringIO()
    writer = DictWriter(text, fieldnames=columns, extrasaction="ignore")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def number(text: str) -> float:
    """The number of a cell; NaN where it is blank."""
    return float(text) if text else math.nan


def middle(values: Iterable[float]) -> float:
    """Median of the values that are finite; NaN where there is none."""
    known = [value for value in values if math.isfinite(value)]
    return float(np.median(known)) if known else math.nan


def grouped(rows: list[Row], *columns: str) -> dict[tuple[str, ...], list[Row]]:
    """Rows by their values of some columns, in the order in which they come.

    >>> grouped([{"a": "1"}, {"a": "2"}, {"a": "1"}], "a")[("1",)]
    [{'a': '1'}, {'a': '1'}]
    """
    found: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        found.setdefault(tuple(row[name] for name in columns), []).append(row)
    return found
