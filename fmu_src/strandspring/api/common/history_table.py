"""Histories of a load case as a table."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import chain, count

import numpy as np

from ...errors import MountedSystemError
from ...vibration.verdicts.answers import CaseAnswer

_LONGEST = 100  # of the name of a file


def history_table(answer: CaseAnswer) -> tuple[list[str], Iterable[Iterable[object]]]:
    """Headings and rows: time, base, points and axes of mounts, in SI units.

    Raises
    ------
    MountedSystemError   If the histories were not kept.
    """
    courses = answer.courses
    if courses is None:
        raise MountedSystemError(f"The histories of {answer.candidate} in {answer.case.name} were not kept.")
    histories = courses.histories
    header = ["time [s]", *(f"base acceleration {letter} [m/s^2]" for letter in "xyz")]
    columns = [histories.time[:, None], courses.base]
    for k, point in enumerate(answer.system.points):
        header += [f"{point.name} acceleration {letter} [m/s^2]" for letter in "xyz"]
        header += [f"{point.name} displacement {letter} [m]" for letter in "xyz"]
        columns += [histories.acceleration[:, k], histories.sway[:, k]]
    for k, name in enumerate(answer.system.axis_names):
        header += [f"{name} displacement of a spring [m]", f"{name} force [N]"]
        columns += [histories.displacement[:, k : k + 1], histories.force[:, k : k + 1]]
    return header, np.hstack(columns).tolist()


def unique_names(texts: Sequence[str]) -> list[str]:
    """Names of files made of texts: letters, digits, signs and underscores, each once.

    Examples
    --------
    >>> unique_names(["softer_shock +x", "softer_shock -x", "a/b", "a b"])
    ['softer_shock_+x', 'softer_shock_-x', 'a_b', 'a_b_2']
    """
    names: list[str] = []
    taken: set[str] = set()
    for text in texts:
        name = re.sub(r"[^\w+-]+", "_", text)[:_LONGEST]
        chosen = next(
            variant for variant in chain([name], (f"{name}_{k}" for k in count(2))) if variant.lower() not in taken
        )
        taken.add(chosen.lower())
        names.append(chosen)
    return names
