"""A measured force-displacement record: checked, read-only arrays in SI units."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import Reader, RecordError
from ..findings import Finding, gathered
from ..ground.files import readable, write_csv
from ..ground.plotfile import some_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FloatArray = NDArray[np.float64]

# Beyond what any rig measures [m], [N], [s]; powers of such numbers overflow or vanish.
_LEAST, _GREATEST = 1e-30, 1e30
_SAME_TIME = 1e-9  # share of the mean step up to which two samples are of one time
# What arrays of no real numbers hold, by NumPy's letter of their kind.
_OTHER_KINDS = {
    "c": "complex numbers",
    "O": "Python objects, or integers too large for a double",
    "U": "text",
    "S": "text",
    "M": "moments",
    "m": "durations",
}


@dataclass(frozen=True, eq=False, repr=False)
class Record:
    """Samples of displacement and force along one path, in the order in which they were measured.

    The arrays are copied, contiguous float64 and read-only, so that a record can be shared freely.

    Attributes
    ----------
    displacement : ndarray, shape (K,)   Displacement [m], K >= 2, finite.
    force : ndarray, shape (K,)          Force [N], finite.
    time : ndarray, shape (K,), or None  Time [s], finite; the model is rate independent and never needs it.
    path : str                           Origin of the record, as given but printable; used in messages.
    sha256 : str or None                 Digest of the file's bytes (hexadecimal), None without a file.
    findings : tuple of Finding          Columns and units as chosen or assumed, rows left out; they name no place.
    compared : ndarray of bool or None   Samples to fit and to compare with a model, shape (K,); the others belong to
                                         the path only. None for all.
    label : str                          Name of the specimen or test, "" without.
    is_cut : bool                        Whether it is a part that was cut out by cycles or time: its cycles are not
                                         counted as those of the whole record.
    first_sample : int                   Index of its first sample in the whole record.

    Raises
    ------
    RecordError                          If an array is not of this kind.
    """

    displacement: FloatArray
    force: FloatArray
    time: FloatArray | None = None
    path: str = "<arrays>"
    sha256: str | None = None
    findings: tuple[Finding, ...] = ()
    compared: NDArray[np.bool_] | None = None
    label: str = ""
    is_cut: bool = False
    first_sample: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", readable(self.path))
        for name in ("displacement", "force") if self.time is None else ("displacement", "force", "time"):
            values = _checked(getattr(self, name), name, self.path)
            _refuse_absurd(values, name, self.path)
            object.__setattr__(self, name, values)
        if self.compared is not None:
            compared = np.array(self.compared)
            if compared.dtype.kind != "b":
                raise RecordError(
                    f"{self.path}: `compared` must be an array of booleans, got an array of {compared.dtype}; pass a "
                    "mask, such as displacement > 0."
                )
            compared.setflags(write=False)
            object.__setattr__(self, "compared", compared)
        for name, column in (("force", self.force), ("time", self.time), ("compared", self.compared)):
            if column is not None and column.size != self.displacement.size:
                raise RecordError(
                    f"{self.path}: `{name}` must have as many samples as `displacement`, "
                    f"got {column.size} and {self.displacement.size}; pass arrays of one length."
                )

    def save(self, path: str | os.PathLike[str], displacement_unit: Literal["m", "mm"] = "m") -> None:
        """Write a CSV file with all digits: `read_record` reads one in m bit for bit, one in mm to the last digit.

        Parameters
        ----------
        path : path-like
        displacement_unit : "m" or "mm"

        Raises
        ------
        StrandspringError   If the file cannot be written.
        ValueError          If the unit is another.

        Examples
        --------
        >>> import tempfile
        >>> from strandspring import Record, read_record
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     Record([0.0, 0.1, 0.0], [0.0, 1.7, -0.3]).save(f"{folder}/loop.csv")
        ...     read_record(f"{folder}/loop.csv").displacement.tolist()
        [0.0, 0.1, 0.0]
        """
        if displacement_unit not in ("m", "mm"):
            raise ValueError(f"`displacement_unit` must be 'm' or 'mm', got {displacement_unit!r}.")
        columns = {} if self.time is None else {"time [s]": self.time}
        columns[f"displacement [{displacement_unit}]"] = (
            self.displacement if displacement_unit == "m" else _millimetres(self.displacement)
        )
        columns["force [N]"] = self.force
        write_csv(Path(path), columns, np.column_stack(list(columns.values())).tolist())

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the force over the displacement.

        Parameters
        ----------
        ax : Axes or None   Of matplotlib; those of a new figure if None.
        """
        (axes,) = some_axes(ax)
        axes.plot(1e3 * self.displacement, self.force, lw=1.0, label=self.label or PurePath(self.path).name)
        axes.set(xlabel="displacement [mm]", ylabel="force [N]")
        axes.legend()
        return axes

    def __repr__(self) -> str:
        x, r = 1e3 * self.displacement, self.force
        times = "" if self.time is None else f", {self.time[-1] - self.time[0]:.4g} s"
        return (
            f"<Record {self.path}: {len(self)} samples{times}, {x.min():.6g} to {x.max():.6g} mm, "
            f"{r.min():.6g} to {r.max():.6g} N>"
        )

    def __len__(self) -> int:
        return self.displacement.size

    @property
    def notes(self) -> tuple[str, ...]:
        """The findings as sentences."""
        return tuple(gathered(self.findings, Reader.PYTHON))

    @property
    def found(self) -> list[Finding]:
        """The findings, with the record as their place."""
        return [replace(finding, where=self.path) for finding in self.findings]

    @cached_property
    def rising_time(self) -> FloatArray | None:
        """Times [s], shape (K,); None without a time column or where it does not rise from sample to sample."""
        if self.time is None:
            return None
        steps = np.diff(self.time)
        return self.time if steps.min() > _SAME_TIME * np.mean(steps) >= 0.0 else None


def _millimetres(metres: FloatArray) -> FloatArray:
    """The numbers that read as these, where there are such; else the nearest."""
    values = metres * 1e3
    for side in (-np.inf, np.inf):
        neighbours = np.nextafter(values, side)
        values = np.where((values * 1e-3 != metres) & (neighbours * 1e-3 == metres), neighbours, values)
    return np.asarray(values)


def _checked(values: ArrayLike, name: str, path: str) -> FloatArray:
    """Return a read-only copy [SI], or refuse anything but a finite series of at least two numbers."""
    if np.ma.is_masked(values):
        raise RecordError(f"{path}: `{name}` must have no masked samples; leave these samples out of all arrays.")
    try:
        raw = np.asarray(values)
    except ValueError:
        raise RecordError(
            f"{path}: `{name}` must have one dimension, got sequences of several lengths; pass an array of numbers."
        ) from None
    if raw.dtype.kind not in "fiub":
        kind = _OTHER_KINDS.get(raw.dtype.kind, f"values of type {raw.dtype}")
        raise RecordError(f"{path}: `{name}` must be an array of real numbers, got {kind}; pass an array of float64.")
    with np.errstate(over="ignore"):  # what overflows is refused below
        array = np.array(raw, dtype=np.float64, order="C")
    if array.ndim != 1:
        raise RecordError(f"{path}: `{name}` must have one dimension, got the shape {array.shape}.")
    if array.size < 2:
        raise RecordError(
            f"{path}: `{name}` must have at least 2 samples, got {array.size}; a path needs a start and an end."
        )
    finite = np.isfinite(array)
    if not finite.all():
        index = int(np.argmin(finite))
        raise RecordError(f"{path}: `{name}` must be finite, got {array[index]} at index {index}; remove the sample.")
    array.setflags(write=False)
    return array


def _refuse_absurd(values: FloatArray, name: str, path: str) -> None:
    largest = float(max(values.max(), -values.min()))
    if largest > 0.0 and not _LEAST <= largest <= _GREATEST:
        raise RecordError(
            f"{path}: the largest `{name}` must be within [{_LEAST:g}, {_GREATEST:g}] in SI units, "
            f"found {largest:.6g}; check its unit."
        )
