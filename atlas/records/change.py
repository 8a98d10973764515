"""AtlasChange: what an atlas made of a touch."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class AtlasChange:
    """What an atlas made of a touch.

    Parameters
    ----------
    refused : str
        Why no samples were entered; empty where some were. The way of an approach that met nothing
        is entered all the same.
    touch : int, optional
        Number of the touch that ``Atlas.add`` learned.
    innovations : (k,) float, no unit
        How far samples of the touch were from the surface that was predicted before them, in
        predicted standard deviations; of those that tell how good the prediction was.
    """

    refused: str = ""
    touch: int | None = None
    innovations: np.ndarray = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)
