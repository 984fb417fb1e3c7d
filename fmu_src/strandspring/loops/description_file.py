"""Description files: the records of a campaign, with columns, units, signs, offsets and what to use of each, as TOML.

    # What holds for all records. Every key may also stand in a record, where it takes precedence.
    displacement = "Weg"            # column: name, or number from 1
    force = "Kraft"
    time = "Zeit"
    displacement_unit = "mm"
    force_unit = "kN"
    reverse = "force"               # the column to negate
    force_offset = 0.12             # subtracted from the column, in its own units

    [[record]]
    file = "lot A/amplitude 13.csv" # relative to this file
    cycles = "2:5"                  # also "2:", ":5", 3
    label = "lot A, 13 mm"

    [[record]]
    file = "lot B/*.tdms"           # a pattern: every file that fits, in the order of their names
    time_window = "0.5:60"          # [s]
    displacement_range = "-20:20"   # [mm], of the displacement after offset and sign
    force_scale = 0.5               # (column - offset) * scale has the unit force_unit

A file is found from the folder of the description; "..", "~" and absolute paths lead out of it and are allowed for
single files, not for patterns.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import RecordError
from ..ground.files import read_text, readable
from ..ground.strict_toml import parse_toml
from ..records.record import Record
from .wanted import Wanted

if TYPE_CHECKING:
    from pydantic import TypeAdapter

_SUFFIX = ".toml"
_MAX_BYTES = 1_000_000
_MAX_FILES = 10_000
_PATTERN = frozenset("*?[")


@dataclass(frozen=True)
class CampaignEntry:
    """One record that is to be read.

    Attributes
    ----------
    path : str
    wanted : Wanted
    """

    path: str
    wanted: Wanted

    def read(self) -> Record:
        """The record."""
        return self.wanted.read(self.path)


def entries(paths: Sequence[str | os.PathLike[str]], given: Wanted | None = None) -> list[CampaignEntry]:
    """The records that paths stand for: each is a record, or a description file (.toml) of several.

    Parameters
    ----------
    paths : sequence of path-like
    given : Wanted, optional        Takes precedence over what description files say.

    Raises
    ------
    RecordError   If a description is wrong; the message names file and field.
    """
    given = given or Wanted()
    listed = []
    for path in paths:
        is_description = os.fspath(path).lower().endswith(_SUFFIX)
        described = _described(Path(path)) if is_description else [CampaignEntry(os.fspath(path), Wanted())]
        listed += [CampaignEntry(entry.path, given.over(entry.wanted)) for entry in described]
    return listed


def read_campaign(path: str | os.PathLike[str], given: Wanted | None = None) -> list[Record]:
    """Read the records of a description file.

    Parameters
    ----------
    path : path-like        The file, see the module's text for a whole example.
    given : Wanted, optional  Takes precedence over what the file says.

    Returns
    -------
    list of Record

    Raises
    ------
    RecordError   If the description or one of the records is wrong; the message names file and field.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import read_campaign
    >>> with TemporaryDirectory() as folder:
    ...     rows = "\\n".join(f"{x},{2 * x}" for x in range(9))
    ...     _ = (Path(folder) / "a.csv").write_text(f"Weg,Kraft\\n{rows}\\n")
    ...     _ = (Path(folder) / "campaign.toml").write_text('''
    ... force_unit = "kN"
    ... [[record]]
    ... file = "a.csv"
    ... label = "lot A"
    ... ''')
    ...     (record,) = read_campaign(Path(folder) / "campaign.toml")
    >>> record.label, len(record), float(record.force.max())
    ('lot A', 9, 16000.0)
    """
    return [(given or Wanted()).over(entry.wanted).read(entry.path) for entry in _described(Path(path))]


def _described(path: Path) -> list[CampaignEntry]:
    name = readable(path)
    text = read_text(path, _MAX_BYTES, "a description file", RecordError)
    try:
        content = parse_toml(text)
    except ValueError as problem:
        raise RecordError(f"{name}: is not valid TOML ({problem}); correct it.") from None
    records = content.pop("record", None)
    if not isinstance(records, list) or not records or not all(isinstance(record, dict) for record in records):
        raise RecordError(f"{name}: must name its records, each as a table [[record]] with the key file.")
    for_all = _checked(content, name)
    listed = []
    for number, record in enumerate(records, 1):
        where = f"{name}, record {number}"
        file = record.pop("file", None)
        if not isinstance(file, str) or not file:
            raise RecordError(f"{where}: must have the key file with a path or pattern, got {file!r:.60}.")
        options = _checked(record, where).over(for_all)
        listed += [CampaignEntry(str(member), options) for member in _files(path, file, where)]
    if len(listed) > _MAX_FILES:
        raise RecordError(f"{name}: must name at most {_MAX_FILES} files, found {len(listed)}; split it.")
    return listed


def _checked(content: Mapping[str, Any], where: str) -> Wanted:
    """The fields of a table, each of the right type and none unknown."""
    from pydantic import ValidationError  # slow to import and rarely needed

    try:
        # As JSON, since strict validation in Python takes no mapping for a dataclass.
        return _validator().validate_json(json.dumps(content, default=str))
    except ValidationError as error:
        problem = error.errors(include_url=False)[0]
        if "error" in (context := problem.get("ctx", {})):
            raise RecordError(f"{where}: {context['error']}") from None
        field = str(problem["loc"][0]) if problem["loc"] else ""
        if problem["type"] == "unexpected_keyword_argument":
            known = ", ".join(option.name for option in fields(Wanted))
            raise RecordError(f"{where}: {field[:60]!r} is not a key; the keys are {known}.") from None
        reason = problem["msg"][:1].lower() + problem["msg"][1:]
        raise RecordError(f"{where}, {field}: {reason}, got {problem['input']!r:.60}.") from None


@cache
def _validator() -> TypeAdapter[Wanted]:
    from pydantic import TypeAdapter

    return TypeAdapter(Wanted)


def _files(description: Path, file: str, where: str) -> list[Path]:
    """The files of one entry, in the order of their names."""
    folder = description.parent
    try:
        path = Path(file).expanduser()
    except RuntimeError as problem:
        raise RecordError(f"{where}, file: {file[:60]!r} names no user's folder ({problem}); give its path.") from None
    if not _PATTERN & set(file) or (folder / path).exists():
        return [folder / path]
    if path.is_absolute() or ".." in path.parts:
        raise RecordError(
            f"{where}, file: a pattern must stay in the folder of the description, got {file[:60]!r}; name the files, "
            "or move the description."
        )
    try:
        fitting = (member for member in folder.glob(file) if member.is_file() and member != description)
        files = sorted(islice(fitting, _MAX_FILES + 1))
    except (ValueError, OSError) as problem:
        raise RecordError(f"{where}, file: {file[:60]!r} is not a usable pattern ({problem}); correct it.") from None
    if not files:
        raise RecordError(
            f"{where}, file: no file fits {file[:60]!r} in the folder {readable(folder.resolve())}; correct the "
            "pattern."
        )
    return files
