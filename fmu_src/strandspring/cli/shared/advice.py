"""Advice in messages names options as Python has them, `keep=...`; the command line prints --keep."""

from __future__ import annotations

import re

_OPTION = re.compile(r"`(\w+)=([^`]*)`")
_UNSAID = ("...", "True")  # values that a flag stands for, or that the user chooses
_OTHER_NAMES = {"time_window": "time"}
# What is no option of the same name in Python.
_OTHERWISE = {
    "`options=RefinedOptions()`": "--method refined",
    "`options=TwoStageOptions()`": "--method two-stage",
    "`with_rivals()`": "--rivals",
}


def with_flags(text: str) -> str:
    """Advice with the options of the command line.

    Examples
    --------
    >>> with_flags("Negate a column with `reverse=force`, or leave it with `keep=...` or `save_anyway=True`.")
    'Negate a column with --reverse force, or leave it with --keep or --save-anyway.'
    """
    for python, flag in _OTHERWISE.items():
        text = text.replace(python, flag)
    return _OPTION.sub(_flag, text)


def _flag(option: re.Match[str]) -> str:
    name, value = option.groups()
    flag = "--" + _OTHER_NAMES.get(name, name).replace("_", "-")
    return flag if value in _UNSAID else f"{flag} {value}"
