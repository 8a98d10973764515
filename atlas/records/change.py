"""AtlasChange: what one change did to the atlas."""

from dataclasses import dataclass


@dataclass(frozen=True)
class AtlasChange:
    """What one change did to the atlas: patch ids.

    ``refused`` says in words why nothing was changed; it is empty otherwise.
    """

    added: tuple[int, ...] = ()
    changed: tuple[int, ...] = ()
    merged: tuple[int, ...] = ()
    split: tuple[int, ...] = ()
    removed: tuple[int, ...] = ()
    refused: str = ""
