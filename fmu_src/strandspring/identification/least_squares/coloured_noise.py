"""Covariance of fitted coefficients when the residuals are correlated from sample to sample.

Least squares with the weights of independent samples, of residuals r and Jacobian J (both weighted), has the covariance

    (J'J)^-1 J'C J (J'J)^-1,

with C the covariance of the noise. C is that of a first-order autoregressive process plus white noise, of unknown
variances and correlation length. A discrete cosine transform of each record diagonalises it nearly (Ahmed, Natarajan
and Rao, IEEE Trans. Computers 23, 1974), so that sums over bands of frequency are all that is needed of the samples.

Residuals vary less than the noise does, and the more so the more it is correlated, since the fit follows slow noise.
The restricted likelihood allows for that (Patterson and Thompson, Biometrika 58, 1971). It is evaluated on a grid of
correlation lengths and shares of white noise, and the covariances are averaged with it as weight, noise that is white
altogether counting as much as all other kinds: what remains unknown about the noise makes the errors larger and, as
degrees of freedom of Student's distribution, the intervals wider.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...kernel.arrays import FloatArray
from .trust_region import triangle_of

_LENGTHS = 14  # correlation lengths tried
_SHORTEST = 0.5  # of them, in samples
_LONGEST = 0.2  # of them, share of the longest record: a longer one looks like a trend
_WHITE = np.array([0.0, 0.003, 0.01, 0.03, 0.1, 0.3, 0.7])  # shares of white noise in the variance tried
_BAND = 1.15  # ratio of the ends of a band of frequencies
_RANK = 1e-10  # singular value below which a combination of coefficients is not determined, share of the largest
_LIKELY = 20.0  # logarithm of the likelihood by which a kind of noise may fall short of the best


class Noise(NamedTuple):
    """A kind of noise: correlation length [samples], share of white noise in its variance, variance."""

    length: float
    white: float
    variance: float


class CoefficientCovariance(NamedTuple):
    """Covariance of p coefficients, of which q combinations are determined.

    Attributes
    ----------
    scale : ndarray, shape (p, q)          From combinations whose columns are orthonormal to the coefficients.
    models : ndarray, shape (m, q, q)      Covariance of these combinations for each likely kind of noise.
    probability : ndarray, shape (m,)      Of each.
    with_own : ndarray, shape (R, q + 1)   Covariance of each record's own coefficient, that of a unit vector, with
                                           these combinations and with itself.
    time : float                           Integrated autocorrelation time of the noise, in samples.
    noise : Noise                          The likeliest kind.
    """

    scale: FloatArray
    models: FloatArray
    probability: FloatArray
    with_own: FloatArray
    time: float
    noise: Noise

    @property
    def root(self) -> FloatArray:
        """Matrix R with the covariance R*R', the mean over the kinds of noise, shape (p, q)."""
        values, vectors = np.linalg.eigh(np.tensordot(self.probability, self.models, 1))
        return np.asarray(self.scale @ (vectors * np.sqrt(np.maximum(values, 0.0))))

    def degrees_of_freedom(self, direction: FloatArray) -> FloatArray:
        """Of Student's distribution of linear functions of the coefficients, shape (k, p), at least 4.

        The variance, uncertain as the noise is, has a mean and a variance over the kinds of noise; that of Student's
        distribution with nu degrees of freedom has the ratio of squared mean to variance (nu - 4)/2.
        """
        along = direction @ self.scale
        variances = np.sum((along @ self.models) * along, axis=2)
        mean = self.probability @ variances
        scatter = self.probability @ (variances - mean) ** 2
        return np.asarray(4.0 + 2.0 * mean**2 / np.maximum(scatter, 1e-9 * mean**2 + 1e-300))


def coefficient_covariance(
    jacobian: FloatArray, own: FloatArray, residuals: FloatArray, records: Sequence[slice]
) -> CoefficientCovariance:
    """Covariance of the coefficients of a least-squares fit with correlated noise.

    Parameters
    ----------
    jacobian : ndarray, shape (P, p)    Weighted, and orthogonal to `own` in each record.
    own : ndarray, shape (P,)           Unit vector along the column of a coefficient that each record has for itself;
                                        zero in records without one.
    residuals : ndarray, shape (P,)     Weighted, in the order of the samples.
    records : sequence of slice         Points of each record, which is a series of its own.
    """
    scale = _orthonormal(jacobian)
    longest = max(piece.stop - piece.start for piece in records)
    bands = _bands(np.column_stack([jacobian @ scale, residuals, own]), records, longest)
    lengths = _SHORTEST * max(_LONGEST * longest / _SHORTEST, 2.0) ** np.linspace(0.0, 1.0, _LENGTHS)
    spectra = _spectra(bands.frequency, lengths)
    products, of_own = bands.sums(1.0 / spectra)
    has_own = of_own[0, :, -1] > 0.0
    crossed, squares = of_own[:, has_own, :-1], of_own[:, has_own, -1:]
    products -= crossed.transpose(0, 2, 1) @ (crossed / squares)
    inner, along, power = products[:, :-1, :-1], products[:, :-1, -1], products[:, -1, -1]
    explained = np.sum(along * np.linalg.solve(inner, along[..., None])[..., 0], axis=1)
    free = max(1, residuals.size - scale.shape[1] - int(has_own.sum()))
    # Without any misfit there is no noise to be found.
    variance = np.maximum(power - explained, 1e-300) / free
    determinant = np.linalg.slogdet(inner)[1] + np.log(squares).sum(axis=(1, 2))
    likelihood = -0.5 * (np.log(spectra) @ bands.number + determinant + free * np.log(variance))
    likelihood[0] += np.log(spectra.shape[0] - 1.0)
    likely = likelihood > likelihood.max() - _LIKELY
    probability = np.exp(likelihood[likely] - likelihood.max())
    probability /= probability.sum()
    models, with_own = bands.sums(spectra[likely] * variance[likely, None])
    with_own = np.delete(np.tensordot(probability, with_own, 1), -2, axis=1)
    at_zero = _spectra(np.zeros(1), lengths)[likely, 0]
    time = float(np.exp(probability @ np.log(at_zero)))
    best = int(np.argmax(likelihood))
    length, white = (lengths[(best - 1) % _LENGTHS], _WHITE[(best - 1) // _LENGTHS]) if best else (_SHORTEST, 1.0)
    return CoefficientCovariance(
        scale,
        models[:, :-1, :-1],
        probability,
        with_own,
        time,
        Noise(float(length), float(white), float(variance[best])),
    )


def whitened(columns: FloatArray, records: Sequence[slice], noise: Noise) -> FloatArray:
    """Cosine transforms of columns over the standard deviation of the noise at each frequency, shape (P, k)."""
    parts = []
    for points in records:
        part = _cosine_transform(columns[points])
        frequency = np.pi * np.arange(part.shape[0]) / part.shape[0]
        spectrum = (1.0 - noise.white) * _autoregressive(frequency, noise.length) + noise.white
        parts.append(part / np.sqrt(noise.variance * spectrum)[:, None])
    return np.concatenate(parts)


def _orthonormal(jacobian: FloatArray) -> FloatArray:
    """Combinations of the columns that are orthonormal, shape (p, q); q < p if some are combinations of others."""
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0.0] = 1.0
    _, singular, vt = np.linalg.svd(triangle_of(jacobian / norms))
    kept = singular > _RANK * singular[0]
    return np.asarray(vt[kept].T / singular[kept] / norms[:, None])


def _spectra(frequency: FloatArray, lengths: FloatArray) -> FloatArray:
    """Spectra of unit variance at each frequency [rad/sample], shape (m, f): white noise first."""
    coloured = _autoregressive(frequency, lengths[:, None])
    mixed = (1.0 - _WHITE)[:, None, None] * coloured + _WHITE[:, None, None]
    return np.concatenate([np.ones((1, frequency.size)), mixed.reshape(-1, frequency.size)])


def _autoregressive(frequency: FloatArray, length: FloatArray | float) -> FloatArray:
    """Spectrum of unit variance of a first-order process with this correlation length."""
    phi = np.exp(-1.0 / np.asarray(length))
    # 1 + phi^2 - 2*phi*cos(w) without loss of digits.
    return np.asarray((1.0 - phi**2) / ((1.0 - phi) ** 2 + 4.0 * phi * np.sin(0.5 * frequency) ** 2))


class _Bands(NamedTuple):
    """Sums over bands of frequency of the cosine transforms of all records.

    Attributes
    ----------
    frequency, number : ndarray, shape (b,)   Mean frequency [rad/sample], number of frequencies.
    products : ndarray, shape (b, q+1, q+1)   Of the columns of the Jacobian, the residuals being the last one.
    of_own : ndarray, shape (b, R, q+2)       Of each record's own column with these and with itself.
    """

    frequency: FloatArray
    number: FloatArray
    products: FloatArray
    of_own: FloatArray

    def sums(self, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Weighted sums of the products, shapes (m, q+1, q+1) and (m, R, q+2)."""
        return np.tensordot(factors, self.products, 1), np.tensordot(factors, self.of_own, 1)


def _bands(columns: FloatArray, records: Sequence[slice], longest: int) -> _Bands:
    count = 2 + int(np.log(longest) / np.log(_BAND))
    frequency, number = np.zeros(count), np.zeros(count)
    products = np.zeros((count, columns.shape[1] - 1, columns.shape[1] - 1))
    of_own = np.zeros((count, len(records), columns.shape[1]))
    for record, points in enumerate(records):
        part = _cosine_transform(columns[points])
        omega = np.pi * np.arange(part.shape[0]) / part.shape[0]
        # The mean is a band of its own; the others begin at the longest record's lowest frequency.
        band = np.zeros(omega.size, np.intp)
        band[1:] = 1 + np.floor(np.log(omega[1:] * longest / np.pi) / np.log(_BAND) + 1e-9).astype(np.intp)
        starts = np.flatnonzero(np.diff(band, prepend=-1))
        for first, last in zip(starts, [*starts[1:], band.size], strict=True):
            of_band = part[first:last].T @ part[first:last]
            products[band[first]] += of_band[:-1, :-1]
            of_own[band[first], record] = of_band[-1]
        number += np.bincount(band, minlength=count)
        frequency += np.bincount(band, weights=omega, minlength=count)
    used = number > 0
    return _Bands(frequency[used] / number[used], number[used], products[used], of_own[used])


def _cosine_transform(columns: FloatArray) -> FloatArray:
    """Orthonormal discrete cosine transform (type II) along the first axis.

    By one Fourier transform of the even samples followed by the odd ones backwards (Makhoul, IEEE Trans. Acoustics,
    Speech and Signal Processing 28, 1980).
    """
    size = columns.shape[0]
    half = np.fft.rfft(np.concatenate([columns[::2], columns[1::2][::-1]]), axis=0)
    half *= (np.sqrt(2.0 / size) * np.exp(-0.5j * np.pi * np.arange(half.shape[0]) / size))[:, None]
    transform = np.concatenate([half.real, -half.imag[1 : (size + 1) // 2][::-1]])
    transform[0] /= np.sqrt(2.0)
    return transform
