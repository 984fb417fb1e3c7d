"""HDF5 files, MATLAB v7.3 among them, read by h5py; links to other files are not followed."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from typing import Any

import h5py
import numpy as np

from ..channels import Channel
from ..content import FileContent
from .named_arrays import Variable, array_channels, channels_of

_MOST = 10_000  # datasets
_DEEPEST = 32
_UNITS = ("unit", "units")


def read_tables(content: FileContent) -> list[Channel]:
    """Channels of the datasets, with the units that their attributes give."""
    file = h5py.File(io.BytesIO(content.data), "r")
    if content.data.startswith(b"MATLAB"):
        return list(channels_of(_matlab_group(file, file)))
    return list(_channels(file))


def _channels(group: h5py.Group, path: str = "", depth: int = 0) -> Iterator[Channel]:
    for name, member in _members(group):
        if isinstance(member, h5py.Group):
            if depth < _DEEPEST:
                yield from _channels(member, f"{path}/{name}" if path else name, depth + 1)
        else:
            yield from array_channels(member, path, name, _unit(member))


def _members(group: h5py.Group) -> Iterator[tuple[str, Any]]:
    """Datasets and groups of a group that lie in this file."""
    for count, name in enumerate(group):
        if count >= _MOST:
            return
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        member = group[name]
        if isinstance(member, h5py.Group) or (
            isinstance(member, h5py.Dataset) and not member.external and not member.is_virtual
        ):
            yield name, member


def _unit(dataset: h5py.Dataset) -> str | None:
    for name in dataset.attrs:
        if name.casefold() in _UNITS:
            return _text(dataset.attrs[name])
    return None


def _text(value: Any) -> str | None:
    """Text of an attribute, which libraries write as text, bytes or an array of one of them."""
    if isinstance(value, np.ndarray):
        value = value.reshape(-1)[0] if value.size == 1 else None
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace").rstrip("\0")
    return value if isinstance(value, str) else None


def _matlab_group(file: h5py.File, group: h5py.Group, depth: int = 0) -> Mapping[str, Variable]:
    """Variables or fields: structs as mappings, text as text, arrays as datasets."""
    variables: dict[str, Variable] = {}
    for name, member in _members(group):
        if name.startswith("#"):
            continue
        kind = _text(member.attrs.get("MATLAB_class"))
        if isinstance(member, h5py.Group):
            if depth < _DEEPEST:
                variables[name] = _matlab_group(file, member, depth + 1)
        elif kind == "char" and member.dtype.kind in "ui" and member.size < 1000:
            variables[name] = "".join(map(chr, member[...].reshape(-1, order="F").tolist()))
        elif kind != "char":
            variables[name] = member
    return variables
