"""Tried: the labels with which moves were tried, so that what stays is not tried again."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

NONE = -1
# Stands for the label of a sample that came later.
NEW = -2
# Growth of a number of samples after which what was tried with them is tried again, and share of
# its samples that a label may lose until then.
_GROWS, _KEPT = 1.25, 0.9


def is_larger(count: int, before: int) -> bool:
    """Whether a number of samples has passed a power of the growth after which things are tried
    again; what is added in small parts passes it as well."""
    steps = np.log(np.maximum([count, before], 1)) / np.log(_GROWS)
    return int(steps[0]) > int(steps[1])


def passed(ends) -> int:
    """The number of samples, of those at the ends (k,) of touches, ascending, that was the first to
    pass the last power of that growth which the last of them has passed.

    >>> passed([250, 300, 350, 400]), passed([250, 300, 350]), passed([100])
    (350, 350, 100)
    """
    power = _GROWS ** np.floor(np.log(max(ends[-1], 1)) / np.log(_GROWS))
    return int(ends[np.searchsorted(ends, power)])


@dataclass(frozen=True, eq=False)
class Tried:
    """The labels with which moves were tried.

    Parameters
    ----------
    of : (n,) int
        Label of each sample then, NONE, or NEW for samples that came later.
    linked : collection of (int, int)
        Labels that were linked then, lower first.
    """

    of: np.ndarray
    linked: Collection[tuple[int, int]] = frozenset()

    def has(self, *labels: np.ndarray) -> bool:
        """Whether labels with samples (m,) had nearly the same ones then, each of them."""
        return all(self._name(members) != NONE for members in labels)

    def has_linked(self, first, second) -> bool:
        """Whether two labels with samples (m,) and (k,) had nearly the same ones then, and were
        linked."""
        names = sorted((self._name(first), self._name(second)))
        return (names[0], names[1]) in self.linked

    def _name(self, members) -> int:
        """The label that samples (m,) had then; NONE where it had many others, too, or they are
        many more."""
        old = self.of[members]
        old = old[old >= 0]
        if not len(old):
            return NONE
        name = int(np.bincount(old).argmax())
        size = int(np.count_nonzero(self.of == name))
        kept = np.count_nonzero(old == name) >= _KEPT * size
        return name if kept and not is_larger(len(members), size) else NONE
