"""Fewer points that look the same: every extreme of a long line stays."""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from ...loops.strokes import IndexArray


def visible(values: FloatArray, most: int) -> IndexArray:
    """Places of at most about `most` samples that draw the same line: the least and greatest of each short piece.

    Parameters
    ----------
    values : ndarray, shape (K,)
    most : int                     At least 4.

    Returns
    -------
    ndarray of int, ascending, with both ends.

    Examples
    --------
    >>> import numpy as np
    >>> visible(np.array([0.0, 0, 0, 9, 0, 0, 0, 0, 0, -5, 0, 0]), 6).tolist()
    [0, 3, 6, 9, 11]
    """
    size = values.size
    if size <= most:
        return np.arange(size)
    pieces = max(1, (most - 2) // 2)
    length = -(-size // pieces)
    padded = np.concatenate([values, np.full(-size % length, values[-1])]).reshape(-1, length)
    begin = np.arange(padded.shape[0]) * length
    chosen = np.concatenate([begin + padded.argmin(axis=1), begin + padded.argmax(axis=1), [0, size - 1]])
    return np.unique(np.minimum(chosen, size - 1))
