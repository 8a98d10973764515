"""AtlasChange: which patches one operation changed."""

from dataclasses import dataclass


@dataclass(frozen=True)
class AtlasChange:
    """The ids of the patches that one operation on an atlas changed.

    Parameters
    ----------
    added, changed : tuple of int
        New patches, and patches with new samples or a new fit.
    merged, split, removed : tuple of int
        Patches that were merged, split, or removed for other reasons.
    refused : str
        Why nothing was changed; empty otherwise.
    """

    added: tuple[int, ...] = ()
    changed: tuple[int, ...] = ()
    merged: tuple[int, ...] = ()
    split: tuple[int, ...] = ()
    removed: tuple[int, ...] = ()
    refused: str = ""
