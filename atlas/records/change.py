"""AtlasChange: which patches one operation changed."""

from dataclasses import dataclass


@dataclass(frozen=True)
class AtlasChange:
    """The ids of the patches that one operation on an atlas changed.

    Parameters
    ----------
    added, changed : tuple of int
        New patches, and patches with new samples or a new fit.
    merged, split : tuple of int
        Former patches that were merged into another one, or split into several.
    removed : tuple of int
        All former patches that are gone, with those two.
    refused : str
        Why nothing was changed; empty otherwise.
    touch : int, optional
        Number of the touch that ``Atlas.add`` learned; None for other operations.
    """

    added: tuple[int, ...] = ()
    changed: tuple[int, ...] = ()
    merged: tuple[int, ...] = ()
    split: tuple[int, ...] = ()
    removed: tuple[int, ...] = ()
    refused: str = ""
    touch: int | None = None
