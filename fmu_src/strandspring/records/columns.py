"""Columns as a header names them, and which of them hold displacement, force and time, in which units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..ground.quoting import quoted
from .units import Quantity, kind_of_unit, unit_factor, words

Asked = Mapping[Quantity, int | str | None]

DEFAULT_UNITS: Mapping[Quantity, str] = {"displacement": "mm", "force": "N", "time": "s"}

# Lower case, without blanks. Words in scripts that have no blanks are also found inside a name.
_WORDS: Mapping[Quantity, frozenset[str]] = {
    "displacement": words(
        """displacement disp displ dist distance position pos deflection stroke travel extension elongation deformation
        x weg federweg auslenkung verschiebung verformung hub déplacement deplacement spostamento
        desplazamiento 位移 变形 行程 変位"""
    ),
    "force": words(
        """force forc load f kraft prüfkraft standardkraft federkraft last forza carico fuerza carga
        力 载荷 荷载 荷重"""
    ),
    "time": words("time t tout zeit temps tempo tiempo 时间 時間"),
}
# Sensors and parts of rigs that stand for displacement, as a unit does.
_MOVED = frozenset(("lvdt", "crosshead", "ram"))
_NOT_FORCE = re.compile("[应應压壓扭]力")  # stress, pressure, torque
_BRACKETED = re.compile(r"[\[(（【]([^\[\]()（）【】]*)[\])）】]")
_AFTER_SLASH = re.compile(r"(.*[^\W\d].*?)\s*/\s*([^\W\d]+)")
_AFTER_BLANK = re.compile(r"(.*[^\W\d].*?)[\s_,]+([^\W\d_]+)")
# Units accepted after a blank or underscore: what is hardly a word. "force_history_NS" has no unit.
_SUFFIX_UNITS = words(
    """m mm MM cm um µm μm in inch inches ft N kN KN MN mN daN lbf lbs kip kips kgf gf
    s sec ms msec min"""
)
# "F_m" may be a measured force and "force_min" the smallest: they do not show that columns are swapped.
_UNSURE_SUFFIXES = words("m in s min N")
# What columns belong to, by where it is said to be; else a file.
_HOLDERS = {"<DataFrame>": "DataFrame", "<arrays>": "Series"}
_FIRST_IDEOGRAPH = "\u4e00"
_NO_RANK = 9
_LISTED_COLUMNS = 12
_LONGEST_NAME = 200  # bounds the time of the patterns above


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    number : int             From 1.
    name : str               In the header, "" without.
    label : str              The name without its unit.
    unit : str or None
    unit_is_sure : bool      Whether that is a unit and not part of the name.
    kind : str or None       Quantity that the unit measures, "other" for another one, None if it is not known.
    cells : tuple of str     The first values, for messages.
    numeric : bool           Whether it holds numbers.
    content : str            What it holds, in words, where there are no cells.
    is_clock : bool          Whether it holds times of day or dates with times, which are read as seconds.
    """

    number: int
    name: str
    label: str
    unit: str | None
    unit_is_sure: bool
    kind: Quantity | Literal["other"] | None
    cells: tuple[str, ...] = ()
    numeric: bool = True
    content: str = ""
    is_clock: bool = False

    @classmethod
    def from_header(cls, number: int, name: str, unit: str | None, **content: Any) -> Column:
        """A column of a name, which may hold its unit, and a unit that the file gives, which takes precedence.

        Parameters
        ----------
        number : int
        name : str           "" without.
        unit : str or None   In brackets or not.
        **content            The last four of the attributes.
        """
        label, in_name, is_sure = split_unit(name)
        if unit is not None and unit.strip("[]() "):
            in_name, is_sure = unit.strip("[]() "), True
        return cls(number, name, label, in_name, is_sure, kind_of_unit(in_name or ""), **content)

    def __str__(self) -> str:
        return f"column {self.number} {quoted(self.name)}" if self.name else f"column {self.number}"


def choose_unit(
    column: Column,
    quantity: Quantity,
    asked: str | None,
    where: str,
    default_units: Mapping[Quantity, str] = DEFAULT_UNITS,
) -> tuple[str, float, Finding]:
    """Unit of a column: the given one, else that in the file, else the default, which is that of test rigs.

    Returns
    -------
    (str, float, Finding)   Unit, its size in SI units, and its origin.

    Raises
    ------
    RecordError         If the unit is unknown, or the units in the file show that columns are swapped.
    """
    if column.is_clock and quantity == "time":
        return "s", 1.0, Finding(Outcome.CLOCK, {"column": str(column)})
    stated = column.unit if column.unit_is_sure or column.kind == quantity else None
    if stated is not None and {column.kind, quantity} == {"displacement", "force"}:
        raise RecordError(
            f"{where}, {column}: must be a {quantity}, but the {_holder(where)} gives it the unit {quoted(stated)} "
            f"of a {column.kind}; the columns look swapped, name them the other way round."
        )
    unit, kind = (asked, Outcome.UNIT_GIVEN) if asked is not None else (stated, Outcome.UNIT_FOUND)
    if unit is None:
        unit, kind = default_units[quantity], Outcome.UNIT_ASSUMED
    elif asked is not None and stated is not None and stated != asked:
        kind = Outcome.UNIT_OVERRULED
    try:
        factor = unit_factor(unit, quantity)
    except RecordError as error:
        raise RecordError(f"{where}, {column}: {error}") from None
    numbers = {"quantity": quantity, "unit": unit, "file": _holder(where), "stated": quoted(stated or "")}
    return unit, factor, Finding(kind, numbers)


def split_unit(header: str) -> tuple[str, str | None, bool]:
    """Label, unit and whether the unit is certain, of "Force [kN]", "Disp/mm" or "force_kN"."""
    if len(header) > _LONGEST_NAME:
        return header, None, False
    groups = [group.strip() for group in _BRACKETED.findall(header) if group.strip()]
    if groups:
        units = [group for group in groups if kind_of_unit(group)]
        return _BRACKETED.sub(" ", header).strip(), (units or groups)[-1], True
    if (match := _AFTER_SLASH.fullmatch(header)) and kind_of_unit(match[2]):
        return match[1], match[2], True
    if (match := _AFTER_BLANK.fullmatch(header)) and match[2] in _SUFFIX_UNITS:
        return match[1], match[2], match[2] not in _UNSURE_SUFFIXES
    return header, None, False


def named_columns(columns: Sequence[Column], quantity: Quantity) -> list[Column]:
    """Columns whose name or unit indicates a quantity, by the strictest rule that finds any."""
    ranks = {column.number: _rank(column, quantity) for column in columns}
    best = min(ranks.values(), default=_NO_RANK)
    best_ranked = [column for column in columns if ranks[column.number] == best < _NO_RANK]
    numeric = [column for column in best_ranked if column.numeric] or best_ranked
    return [column for column in numeric if column.kind == quantity] or numeric


def _rank(column: Column, quantity: Quantity) -> int:
    """0: the name is a word for the quantity; 1: it begins with one; 2: it holds one; 3: its unit or sensor."""
    known = _WORDS[quantity]
    separate = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", column.label).casefold()
    tokens = [token for token in re.split(r"[\W\d_]+", separate) if token]
    if "".join(tokens) in known:
        return 0
    # A single letter is a name, but says nothing inside one: "Force x".
    is_word = [len(token) > 1 and token in known for token in tokens]
    if is_word and is_word[0]:
        return 1
    without_stress = _NOT_FORCE.sub("", column.label)
    if any(is_word) or any(word in without_stress for word in known if word[0] >= _FIRST_IDEOGRAPH):
        return 2
    is_timed = column.is_clock and quantity == "time"
    is_moved = quantity == "displacement" and column.kind in (None, quantity) and not _MOVED.isdisjoint(tokens)
    return 3 if is_timed or is_moved or (column.unit_is_sure and column.kind == quantity) else _NO_RANK


def listed_columns(columns: Sequence[Column]) -> str:
    """Columns with first value and range in the first rows, such as "column 1 'Time' (0.0 first, 0 to 12)"."""
    texts = []
    for column in columns[:_LISTED_COLUMNS]:
        values = [cell for cell in column.cells if cell]
        content = f" ({quoted(values[0])[1:-1]} first{_range(values)})" if values else f" ({column.content or 'empty'})"
        texts.append(f"{column}{content}")
    more = len(columns) - _LISTED_COLUMNS
    rows = max((len(column.cells) for column in columns), default=0)
    return (
        ", ".join(texts) + (f" and {more} more" if more > 0 else "") + (f" (in the first {rows} rows)" if rows else "")
    )


def _range(cells: Sequence[str]) -> str:
    try:
        values = [float(cell.replace(",", ".")) for cell in cells]
    except ValueError:
        return ""
    known = [value for value in values if not math.isnan(value)]
    return f", {min(known):.6g} to {max(known):.6g}" if known else ", no numbers"


def choose_columns(columns: Sequence[Column], asked: Asked, where: str) -> tuple[dict[Quantity, Column], list[Finding]]:
    """Find the columns of displacement, force and, where there is one, time.

    Parameters
    ----------
    columns : sequence of Column   All columns of the table.
    asked : mapping                Name or 1-based number per quantity, None to detect it by its name.
    where : str                    File, for messages.

    Returns
    -------
    (dict, list of Finding)        Column per quantity; the decisions.

    Raises
    ------
    RecordError                    If a column is missing, ambiguous or given twice.
    """
    chosen: dict[Quantity, Column] = {
        quantity: asked_column(columns, wanted, quantity, where)
        for quantity, wanted in asked.items()
        if wanted is not None
    }
    quantities: dict[int, Quantity] = {}
    for quantity, column in chosen.items():
        if column.number in quantities:
            raise RecordError(
                f"{where}: {column} must not be both {quantities[column.number]} and {quantity}; name two columns."
            )
        quantities[column.number] = quantity
    kinds = dict.fromkeys(chosen, Outcome.COLUMN_GIVEN)
    beside: list[Finding] = []
    has_names = any(column.name for column in columns)
    for quantity in ("displacement", "force", "time"):
        if quantity in chosen:
            continue
        free = [column for column in columns if column not in chosen.values()]
        candidates = named_columns(free, quantity)
        if len(candidates) == 1:
            chosen[quantity], kinds[quantity] = candidates[0], Outcome.COLUMN_FOUND
        elif quantity == "time":
            if candidates:
                beside.append(Finding(Outcome.TIME_LEFT_OUT, {"columns": listed_columns(candidates)}))
            elif free:
                beside.append(Finding(Outcome.NO_TIME))
        elif not has_names and len(columns) == 2 and free and not candidates:
            chosen[quantity], kinds[quantity] = free[0], Outcome.COLUMN_ASSUMED
        else:
            raise _ambiguity(free, candidates, quantity, has_names, where)
    found = [Finding(kind, {"quantity": name, "column": str(chosen[name])}) for name, kind in kinds.items()]
    return chosen, [*found, *beside]


def asked_column(columns: Sequence[Column], wanted: int | str, quantity: str, where: str) -> Column:
    """The column of a name or 1-based number; `quantity` says in messages what it holds."""
    if isinstance(wanted, str):
        text = wanted.strip()
        rules = (
            lambda column: column.name == text,
            lambda column: column.name.casefold() == text.casefold(),
            lambda column: _squeezed(column.name) == _squeezed(text),
            lambda column: _squeezed(column.label) == _squeezed(split_unit(text)[0]),
        )
        for rule in rules:
            fitting = [column for column in columns if column.name and rule(column)]
            if len(fitting) == 1:
                return fitting[0]
            if fitting:
                raise RecordError(
                    f"{where}: {quantity} column {quoted(wanted)} must name one column, "
                    f"but it fits {listed_columns(fitting)}; give a number."
                )
        if not re.fullmatch(r"[0-9]{1,9}", text):
            raise RecordError(
                f"{where}: {quantity} column {quoted(wanted)} is not in the {_holder(where)}, "
                f"which has {listed_columns(columns)}; give one of these names or numbers."
            )
    elif not isinstance(wanted, int | np.integer):
        raise RecordError(
            f"{where}: {quantity} column must be a name or a number from 1 on, got {type(wanted).__name__}; "
            f"the {_holder(where)} has {listed_columns(columns)}."
        )
    number = int(wanted)
    if not 1 <= number <= len(columns):
        raise RecordError(
            f"{where}: {quantity} column must be 1 to {len(columns)}, got {number}; the {_holder(where)} has "
            f"{listed_columns(columns)}."
        )
    return columns[number - 1]


def _ambiguity(
    columns: Sequence[Column], candidates: Sequence[Column], quantity: Quantity, has_names: bool, where: str
) -> RecordError:
    if candidates:
        reason = f"{listed_columns(candidates)} could be the {quantity}"
    elif has_names:
        reason = f"no column is named like a {quantity} among {listed_columns(columns)}"
    else:
        reason = f"there is no header to find the {quantity} by among {listed_columns(columns)}"
    sentence = "{where}: {reason}; name the columns with {to[displacement]} and {to[force]}."
    return RecordError(sentence, where=where, reason=reason)


def _holder(where: str) -> str:
    return _HOLDERS.get(where, "file")


def _squeezed(name: str) -> str:
    return re.sub(r"[\s_]+", "", name).casefold()
