"""AtlasChange: which patches one operation changed."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class AtlasChange:
    """The ids of the patches that one operation on an atlas changed.

    Parameters
    ----------
    added, changed : tuple of int
        New patches, and patches with new samples or a new fit.
    removed : tuple of int
        Former patches that are gone.
    refused : str
        Why nothing was changed; empty otherwise.
    touch : int, optional
        Number of the touch that ``Atlas.add`` learned; None for other operations.
    innovations : (k,) float, no unit
        How far samples of the touch were from the surface that was predicted before them, in
        predicted standard deviations; of those that tell how good the prediction was.
    """

    added: tuple[int, ...] = ()
    changed: tuple[int, ...] = ()
    removed: tuple[int, ...] = ()
    refused: str = ""
    touch: int | None = None
    innovations: np.ndarray = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)
