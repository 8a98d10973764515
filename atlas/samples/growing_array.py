"""Arrays that grow by rows, as the patches and samples of an atlas do."""

import numpy as np


def grown(array: np.ndarray, rows: int) -> np.ndarray:
    """The array, or a longer copy of it that has room for a number of rows.

    A copy is longer by an eighth at least, so that many small steps copy each row few times.

    >>> len(grown(np.zeros(16), 16)), len(grown(np.zeros(16), 17)), len(grown(np.zeros(16), 40))
    (16, 18, 40)
    """
    if rows <= len(array):
        return array
    added = max(rows, len(array) * 9 // 8) - len(array)
    return np.concatenate([array, np.zeros((added, *array.shape[1:]), array.dtype)])
