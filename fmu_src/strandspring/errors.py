"""Errors that reach the user, and the words of sentences whose numbers and options are data.

A template is a sentence with fields as `str.format` takes them. `{to[delay]}` in it names an option of the API,
`{to[reverse=force]}` one with a value, `{to[save_anyway=True]}` one to switch on, and `{to[plan()]}` a function.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from string import Formatter
from typing import Any

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_FACTORS = {
    "mm": 1e3, "ms": 1e3, "mm/s": 1e3, "%": 100.0, "N/mm": 1e-3, "degrees": 180.0 / math.pi, "g": 1.0 / 9.80665,
}  # from SI  # fmt: skip
# Options of the command line that have another name.
_FLAGS = {
    "amplitudes": "amplitude", "candidates": "candidate", "cases": "case", "directions": "direction", "fields": "field",
    "platforms": "platform", "time_window": "time",
}  # fmt: skip


class Reader(Enum):
    """Who reads a sentence: a person at the command line, one who writes Python, or one who reads a file."""

    COMMAND_LINE = "command line"
    PYTHON = "Python"
    FILE = "file"


class _Options:
    """Options of the API as a reader names them."""

    def __init__(self, reader: Reader) -> None:
        self.reader = reader

    def __getitem__(self, option: str) -> str:
        name, _, value = option.partition("=")
        if name.endswith("()"):
            command = f"strandspring {name[:-2].replace('_', '-')}"
            return {Reader.COMMAND_LINE: f"`{command}`", Reader.PYTHON: f"`{name}`", Reader.FILE: command}[self.reader]
        given = value if value not in ("", "True") else ""
        if self.reader is Reader.COMMAND_LINE:
            return f"{flag_of(name)} {given}".rstrip()
        if self.reader is Reader.FILE:
            return f"the option {name} {given}".rstrip()
        return f'`{name}="{given}"`' if given and not given.isdigit() else f"`{name}={value or '...'}`"


def flag_of(option: str) -> str:
    """An option of the API on the command line."""
    return f"--{_FLAGS.get(option, option).replace('_', '-')}"


class _Words(Formatter):
    """Fields in the notation of a reader."""

    def __init__(self, reader: Reader) -> None:
        self.reader, self.is_printed = reader, reader is Reader.FILE

    def format_field(self, value: Any, format_spec: str) -> str:
        spec, _, unit = format_spec.partition(" ")
        values = value if isinstance(value, list | tuple) else [value]
        text = ", ".join(self._text(one, spec, _FACTORS.get(unit, 1.0)) for one in values)
        return f"{text} {unit}" if unit else text

    def _text(self, value: Any, spec: str, factor: float) -> str:
        if isinstance(value, list | tuple):
            return " to ".join(dict.fromkeys(self._text(end, spec, factor) for end in value))
        if isinstance(value, StrandspringError):
            return value.words(self.reader)
        if not isinstance(value, int | float):
            return str(value)
        text = format(value * factor if factor != 1.0 else value, spec)
        if not self.is_printed:
            return text
        mantissa, e, exponent = text.partition("e")
        power = f"×10{str(int(exponent)).translate(_RAISED)}" if e else ""
        return mantissa.replace("-", "\N{MINUS SIGN}") + power


def worded(template: str, fields: Mapping[str, Any], reader: Reader) -> str:
    """A sentence from its template and fields, for a reader.

    Parameters
    ----------
    template : str
    fields : mapping    Numbers in SI units, of which `{width:.3g mm}` shows one, or all of a sequence, in millimetres;
                        names, or sequences of them; errors, whose words are made for the same reader. A sequence in a
                        sequence is a range, such as 3 to 5 mm.
    reader : Reader

    Examples
    --------
    >>> template = "The force falls by {fall:.2g N} over {way:.3g mm}; negate it with {to[reverse=force]}."
    >>> fields = {"fall": -3e-7, "way": (0.012, 0.02)}
    >>> worded(template, fields, Reader.COMMAND_LINE)
    'The force falls by -3e-07 N over 12, 20 mm; negate it with --reverse force.'
    >>> worded(template, fields, Reader.PYTHON)
    'The force falls by -3e-07 N over 12, 20 mm; negate it with `reverse="force"`.'
    >>> worded(template, fields, Reader.FILE)
    'The force falls by −3×10⁻⁷ N over 12, 20 mm; negate it with the option reverse force.'
    """
    sign = "±" if reader is Reader.FILE else "+-"
    return _Words(reader).vformat(template.replace("+-", sign), (), {**fields, "to": _Options(reader)})


class StrandspringError(ValueError):
    """Base class of errors in data, models and options; the message is written for the user.

    Parameters
    ----------
    sentence : str   The message; with fields a template of it, see `worded`.
    **fields         What the sentence is made of.
    """

    def __init__(self, sentence: str = "", **fields: Any) -> None:
        self.template, self.fields = sentence, fields
        super().__init__(self.words(Reader.PYTHON))

    def words(self, reader: Reader) -> str:
        """The message for a reader."""
        return worded(self.template, self.fields, reader) if self.fields else self.template


class OptionError(StrandspringError):
    """Options do not go together, or not with what they are given for."""


class RecordError(StrandspringError):
    """A measured record cannot be used."""


class ModelError(StrandspringError):
    """A model file or a set of parameters is not a physically possible spring."""


class BuildError(StrandspringError):
    """An FMU cannot be built, validated or run."""


class IsolationError(StrandspringError):
    """A mass cannot be isolated by its mount, or a study of it cannot be run."""


class JobError(StrandspringError):
    """Tasks cannot be executed, or what is finished cannot be kept."""


class MountedSystemError(StrandspringError):
    """Bodies on mounts that cannot be, or cannot be simulated as asked."""
