"""Springs that differ from their batch, by the robust rule of Iglewicz and Hoaglin (1993).

The modified z-score of a figure is z = (ln f - median)/s over the batch, with s = 1.4826 times the median absolute
deviation of ln f, which is the standard deviation of normal numbers. |z| > 3.5 is an outlier. Logarithms, because the
figures are positive and their scatter is relative.

Of a clean batch of normal figures this flags in each figure a share of springs that falls with the size of the batch,
because the median and s are estimated: 2 % of the springs with 8, 1 % with 15, 0.4 % with 30, 0.2 % with 50, 0.1 % with
100, 0.05 % with 1000 or more. Several figures together flag up to as many times more.
"""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray

LIMIT = 3.5
# Fewer springs have no scatter to speak of.
FEWEST = 8
_NORMAL = 1.482602  # standard deviation over median absolute deviation, of normal numbers
_NORMAL_MEAN = 1.253314  # standard deviation over mean absolute deviation, likewise
_LEAST = 1e-3  # least s: springs that differ by less than 0.35 % are alike, however alike the others are


def modified_z(figures: FloatArray) -> FloatArray:
    """Modified z-scores of the logarithms of a figure.

    Parameters
    ----------
    figures : ndarray, shape (K,)   NaN where unknown; below 0 counts as 0.

    Returns
    -------
    ndarray, shape (K,)             0 where unknown, and of fewer than `FEWEST` known figures; -inf of figures that are
                                    not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from strandspring.campaigns.batches.outliers import modified_z
    >>> modified_z(np.array([9.8, 9.9, 10.0, 10.0, 10.1, 10.2, 10.3, 20.0])).round(1).tolist()
    [-1.1, -0.7, -0.2, -0.2, 0.2, 0.7, 1.1, 31.1]
    """
    z = np.zeros(figures.size)
    known = np.isfinite(figures)
    if np.sum(known) < FEWEST:
        return z
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithms = np.log(np.maximum(figures[known], 0.0))
        median = float(np.median(logarithms))
        if not np.isfinite(median):  # most are not positive
            return z
        distance = np.abs(logarithms - median)
        scale = _NORMAL * float(np.median(distance))
        if scale == 0.0:  # more than half are equal
            scale = _NORMAL_MEAN * float(np.mean(distance[np.isfinite(distance)]))
        z[known] = (logarithms - median) / max(scale, _LEAST)
    return z
