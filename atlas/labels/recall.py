"""Recall: what was computed of samples before, by all that it depends on."""

from collections.abc import Callable
from hashlib import blake2b
from typing import Any

import numpy as np


class Recall:
    """Results of this labelling, and those of the one before it, of the first of the samples.

    A labelling that goes on from another one asks for much again. What two in a row do not ask for
    is forgotten.

    Parameters
    ----------
    before : Recall, optional
        That of a labelling of the first of the samples.

    Examples
    --------
    >>> once = Recall()
    >>> once.get(lambda: 1, "key"), once.get(lambda: 2, "key"), Recall(once).get(lambda: 3, "key")
    (1, 1, 1)
    """

    def __init__(self, before: "Recall | None" = None) -> None:
        self._now: dict[tuple, Any] = {}
        self._before = {} if before is None else before._now

    def get(self, compute: Callable[[], Any], *depends: Any) -> Any:
        """The result, computed where it is not known, by what it depends on: a name, and pieces,
        numbers and arrays."""
        key = tuple(
            blake2b(x.tobytes()).digest() if isinstance(x, np.ndarray) else x for x in depends
        )
        if key not in self._now:
            self._now[key] = self._before[key] if key in self._before else compute()
        return self._now[key]
