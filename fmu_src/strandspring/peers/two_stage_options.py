"""The two-stage method with what the paper tried: its three-point formulas, and filters against noise (section 3.3).

The paper's own formulas are mean branches in the steady section, and three points for rho, n and sigma. They are kept
for comparison with the paper, and fragile under noise, most of all for n well below 1, where the slope of omega has a
cusp just where eq. (23) reads it.

Filters against heavy noise (paper section 3.3) choose their cut-off from the record's noise: with the noise power v per
coefficient read off the highest frequencies, a filter of gain g leaves of a coefficient of power P the expected squared
error (1 - g)^2*(P - v) + g^2*v, signal lost plus noise kept, and the cut-off is the one with the least sum. A record
without noise keeps everything that stands above its own highest harmonics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from ..errors import RecordError
from ..identification.least_squares.stages import N_BOUNDS, SIGMA_BOUNDS, Backbone, Hysteresis
from ..identification.methods.fitted import Fitted, fitted
from ..identification.methods.method import Method
from ..identification.points.polynomials import Basis, Columns
from ..identification.points.sample_points import SamplePoints, join, single_branch
from ..identification.points.smoothing import automatic_half_width, moving_average
from ..identification.points.steady_part import SteadyRecord, mean_loop
from ..identification.search.two_stage import Stages, two_stage, whole_branches
from ..kernel.arrays import FloatArray
from ..records.record import Record
from .periods import whole_periods

_FILTERS = ("moving-average", "low-pass", "fourier")
# omega at the points H1 (recovering), H2 and H3 (approaching saturation). H1 moves towards zero if the branch is
# sampled from later on only.
_H1, _H2, _H3 = -0.5, 0.35, 0.7
# Where the loading branch is looked at: densely after the reversal.
_BRANCH_SHARES = ((np.arange(200) + 0.5) / 200) ** 2
_ORDER = 4  # of the Butterworth filter, which runs forth and back
_CUTOFFS = 60  # tried between one half cycle per record and the Nyquist frequency
_FEWEST = 16  # samples


def three_point_stages(
    loops: SamplePoints, basis: Basis, columns: Columns, steady_travels: Sequence[float], smoothing: int | None
) -> list[tuple[Hysteresis, float] | None]:
    """Both stages by the paper's formulas; arguments and result as `identification.two_stage.Stages` says."""
    return [_both_stages(loops, basis, columns, travel, smoothing) for travel in steady_travels]


_FORMULAS: dict[str, Stages] = {"whole-branch": whole_branches, "three-point": three_point_stages}


def _both_stages(
    loops: SamplePoints, basis: Basis, columns: Columns, steady_travel: float, smoothing: int | None
) -> tuple[Hysteresis, float] | None:
    backbone = fit_backbone_paper(loops, basis, columns, steady_travel)
    if backbone is None:
        return None
    mean = mean_loop(loops, _BRANCH_SHARES)
    at_E, at_A = basis.columns(mean.displacement)
    G = at_A @ backbone.amplified
    if not (G > 0.0).all():
        return None
    u = (mean.loading - at_E @ backbone.elastic) / G
    branch = single_branch(mean.displacement, u)
    half_width = automatic_half_width(branch, u) if smoothing is None else smoothing
    hysteresis = three_points(mean.displacement - basis.low, moving_average(branch, u, half_width))
    if hysteresis is None:
        return None
    omega = loops.omega(hysteresis.rho, hysteresis.sigma, hysteresis.n)
    return hysteresis, loops.rms(backbone.misfit(loops.force, omega))


def fit_backbone_paper(loops: SamplePoints, basis: Basis, columns: Columns, steady_travel: float) -> Backbone | None:
    """Stage 1 by paper eqs. (14)-(20): both branches at the same x, where both have travelled far enough.

    Parameters
    ----------
    loops : SamplePoints
    basis : Basis
    columns : Columns       Basis functions at the points of the loops.
    steady_travel : float   Distance from a reversal beyond which a branch counts as saturated [m].

    Returns
    -------
    Backbone or None        None if the steady section is too short for the degrees or the branches touch at x0.
    """
    mean = mean_loop(loops)
    x = mean.displacement
    steady = (x >= basis.low + steady_travel) & (x <= basis.high - steady_travel)
    columns_E, columns_A = basis.columns(x[steady])
    if steady.sum() < 2 * max(columns_E.shape[1], columns_A.shape[1]):
        return None
    upper, lower = mean.loading[steady], mean.unloading[steady]
    kappa = float(np.interp(basis.offset, x[steady], 0.5 * (upper - lower)))
    if kappa <= 0.0:
        return None
    elastic = np.asarray(np.linalg.lstsq(columns_E, 0.5 * (upper + lower), rcond=None)[0], np.float64)
    amplifier = np.asarray(np.linalg.lstsq(columns_A, 0.5 * (upper - lower) / kappa, rcond=None)[0], np.float64)
    return Backbone(elastic, kappa * amplifier, columns.elastic @ elastic, kappa * (columns.amplifier @ amplifier))


def three_points(travel: FloatArray, u: FloatArray) -> Hysteresis | None:
    """Stage 2 by paper eqs. (23)-(25) on one branch of the extracted, smoothed loop.

    Parameters
    ----------
    travel : ndarray, shape (P,)   Distance from the reversal [m], rising.
    u : ndarray, shape (P,)        omega of the branch, times -1 on an unloading one.

    Returns
    -------
    Hysteresis or None             None if the branch does not pass the points in order.
    """
    slope = np.gradient(u, travel)
    rising = np.maximum.accumulate(u)

    def at(level: float) -> tuple[float, float]:
        k = int(np.searchsorted(rising, level))
        if not 0 < k < u.size:
            return np.nan, np.nan
        share = (level - rising[k - 1]) / max(rising[k] - rising[k - 1], 1e-300)
        return level, float(slope[k - 1] + share * (slope[k] - slope[k - 1]))

    _, rho = at(0.0)  # eq. (23)
    u1, slope1 = at(max(_H1, 0.5 * float(u[0])))
    u2, slope2 = at(_H2)
    u3, slope3 = at(_H3)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        n = np.log((slope2 - rho) / (slope3 - rho)) / np.log(u2 / u3)  # eq. (24)
        sigma = 0.5 * ((slope1 / rho - 1.0) / np.abs(u1) ** n + 1.0)  # eq. (25)
    if not (rho > 0.0 and np.isfinite(n) and n > 0.0 and np.isfinite(sigma)):
        return None
    return Hysteresis(rho, float(np.clip(sigma, *SIGMA_BOUNDS)), float(np.clip(n, *N_BOUNDS)))


@dataclass(frozen=True)
class TwoStageOptions(Method):
    """Options of the two-stage method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; chosen from the data if None.
    formulas : str                 "whole-branch" least squares, or the paper's "three-point" formulas.
    smoothing : int or None        Half width of the moving average in points; from the noise if None.
    filter : str                   What is done against noise first: only the "moving-average", or a zero-phase
                                   "low-pass" or the "fourier" series of whole periods before it.
    """

    name: ClassVar[str] = "two-stage"

    formulas: Literal["whole-branch", "three-point"] = "whole-branch"
    smoothing: int | None = None
    filter: Literal["moving-average", "low-pass", "fourier"] = "moving-average"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value, allowed in (("formulas", self.formulas, _FORMULAS), ("filter", self.filter, _FILTERS)):
            if value not in allowed:
                raise ValueError(f"`{name}` must be one of {', '.join(allowed)}, got {value!r}.")
        if self.smoothing is not None and not 0 <= self.smoothing <= 10_000:
            raise ValueError(f"`smoothing` must be within [0, 10000] points, got {self.smoothing}.")

    def prepare(self, record: Record) -> Record:
        """The record with its force filtered; the moving average comes later, along the strokes.

        "low-pass" keeps the samples, "fourier" gives one mean period twice over at uniform phases. Both choose their
        cut-off from the record's noise.

        Raises
        ------
        RecordError   If the record holds no whole periods, or too few samples.
        """
        if self.filter == "moving-average":
            return record
        if record.compared is not None and self.filter == "fourier":
            raise RecordError(
                f"{record.path}: the Fourier filter takes whole periods; select no range of displacement, or use "
                "another `filter=...`."
            )
        # SciPy's signal processing takes a third of a second to import, and most identifications go without.

        try:
            if self.filter == "low-pass":
                return replace(record, force=low_pass(record.force))
            periods = whole_periods(record.displacement, record.force, record.time)
            flat = fourier_filter(periods.force.ravel(), periods.count)
        except ValueError as problem:
            raise RecordError(f"{record.path}: {problem}") from None
        size = periods.displacement.size
        twice = np.concatenate([np.tile(np.arange(size), 2), [0]])
        return replace(record, displacement=periods.displacement[twice], force=flat[:size][twice], time=None)

    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Identify without start values."""
        loops = join([part.loops for part in parts])
        return fitted(loops, two_stage(loops, self.degrees, _FORMULAS[self.formulas], self.smoothing), where)


def low_pass(force: FloatArray) -> FloatArray:
    """Zero-phase Butterworth low-pass of order 4, run forth and back, on samples uniform in time.

    At the cut-off a quarter of the power, half of the amplitude, is left.

    Parameters
    ----------
    force : ndarray, shape (K,)   [N], or any other signal.

    Returns
    -------
    ndarray, shape (K,)           [N]

    Raises
    ------
    ValueError                    If there are fewer than 16 samples.
    """
    from scipy.signal import butter, sosfiltfilt  # slow to import

    values = _checked(force)
    cutoff = _cutoff_of_noise(values)
    if cutoff is None:
        return values.copy()
    sections = butter(_ORDER, 2.0 * cutoff, output="sos")
    # The transient at the ends lasts about a period of the cut-off frequency for each order.
    padding = min(values.size - 1, math.ceil(_ORDER / cutoff))
    width = min(values.size, max(2, math.ceil(0.25 / cutoff)))
    head = 2.0 * _end_value(values[:width]) - values[padding:0:-1]
    tail = 2.0 * _end_value(values[: -width - 1 : -1]) - values[-2 : -padding - 2 : -1]
    smooth = sosfiltfilt(sections, np.concatenate([head, values, tail]), padlen=0)
    return np.asarray(smooth[padding : padding + values.size])


def fourier_filter(force: FloatArray, periods: int) -> FloatArray:
    """Ni's non-causal filter: the discrete Fourier series over whole periods without its high harmonics.

    What lies between the harmonics goes as well, so that every period comes out the same.

    Parameters
    ----------
    force : ndarray, shape (K,)   Exactly `periods` whole periods at uniform phases [N].
    periods : int                 Number of periods in it, >= 1.

    Returns
    -------
    ndarray, shape (K,)           [N]

    Raises
    ------
    ValueError                    If there are fewer than 16 samples in a period.
    """
    values = _checked(force)
    if values.size < _FEWEST * periods:
        raise ValueError(
            f"`force` must have at least {_FEWEST} samples per period, got {values.size} for {periods} periods."
        )
    spectrum = np.fft.rfft(values)
    harmonics = _harmonics_of_noise(np.abs(spectrum[::periods]) ** 2)
    kept = np.zeros(spectrum.size)
    kept[: harmonics * periods + 1 : periods] = 1.0
    return np.fft.irfft(spectrum * kept, values.size)


def _end_value(values: FloatArray) -> float:
    """First of the values on their straight line: reflected about the sample itself, its noise would stay."""
    position = np.arange(values.size)
    return float(np.polyval(np.polyfit(position, values, 1), 0.0))


def _harmonics_of_noise(power: FloatArray) -> int:
    """Number of harmonics with the least expected error; ``power[h]`` belongs to harmonic h."""
    noise = _floor(power)
    # A harmonic kept costs v, one dropped costs P - v.
    change = np.cumsum(2.0 * noise - power[1:])
    return int(np.argmin(change)) + 1


def _cutoff_of_noise(values: FloatArray) -> float | None:
    """Cut-off of `low_pass` with the least expected error [cycles per sample]; None if no filter does better."""
    from scipy.fft import dct  # slow to import

    # The cosine transform continues a signal evenly, so that ends of different height make no high frequencies.
    power = dct(values, norm="ortho")[1:] ** 2
    noise = _floor(power)
    frequency = 0.5 * np.arange(1, values.size) / values.size
    signal = power - noise
    best, least = None, noise * power.size
    for cutoff in np.geomspace(frequency[0], 0.45, _CUTOFFS):
        gain = 1.0 / (1.0 + (np.tan(math.pi * frequency) / math.tan(math.pi * cutoff)) ** (2 * _ORDER))
        error = float(np.sum((1.0 - gain) ** 2 * signal + gain**2 * noise))
        if error < least:
            best, least = float(cutoff), error
    return best


def _floor(power: FloatArray) -> float:
    """Noise power per coefficient: the mean of the upper half of the frequencies."""
    return float(np.mean(power[power.size // 2 :]))


def _checked(force: FloatArray) -> FloatArray:
    values = np.asarray(force, dtype=np.float64)
    if values.ndim != 1 or values.size < _FEWEST:
        raise ValueError(f"`force` must have shape (K,) with K >= {_FEWEST}, got shape {values.shape}.")
    if not np.isfinite(values).all():
        raise ValueError("`force` must be finite [N]; remove the samples that are not.")
    return values
