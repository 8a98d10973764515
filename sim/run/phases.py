"""Phases of a run: what it is doing, and how many seconds each took."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Phases:
    """Names each phase when it begins, and counts its seconds.

    Parameters
    ----------
    tell : called with what is being done, in words, when a phase begins

    Examples
    --------
    >>> phases = Phases(print)
    >>> with phases("surface", "extracting the surface"):
    ...     pass
    extracting the surface
    >>> list(phases.seconds)
    ['surface']
    """

    def __init__(self, tell: Callable[[str], None] = lambda words: None) -> None:
        self._tell = tell
        self._start = time.perf_counter()
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, name: str, words: str) -> Iterator[None]:
        """A block whose seconds are counted under ``name``."""
        self._tell(words)
        start = time.perf_counter()
        try:
            yield
        finally:
            self.add(name, time.perf_counter() - start)

    def add(self, name: str, seconds: float) -> None:
        """Count seconds under a name."""
        self.seconds[name] = self.seconds.get(name, 0.0) + seconds

    def elapsed(self) -> float:
        """Seconds since the first phase could begin."""
        return time.perf_counter() - self._start
