"""NumPy arrays in .npy and .npz files; objects, which would have to be unpickled, are not read."""

from __future__ import annotations

import io
import zipfile

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ...errors import RecordError
from ..channels import Channel
from ..content import FileContent, check_members
from .named_arrays import channels_of


def read_tables(content: FileContent) -> list[Channel]:
    """Channels of the arrays.

    Raises
    ------
    RecordError   If one is damaged, or all are of objects.
    """
    if content.data.startswith(b"\x93NUMPY"):
        members = {"": content.data}
    else:
        with zipfile.ZipFile(io.BytesIO(content.data)) as archive:
            check_members(archive, content.path)
            members = {name.removesuffix(".npy"): archive.read(name) for name in archive.namelist()}
    arrays = {name: _array(data) for name, data in members.items()}
    known = {name: array for name, array in arrays.items() if array is not None}
    if not known:
        raise RecordError(
            f"{content.path}: holds Python objects (a pickle), which may run any program and are never read; save "
            "arrays of numbers."
        )
    return list(channels_of(known))


def _array(data: bytes) -> NDArray[np.generic] | None:
    """The array of an .npy file; None if it is of objects."""
    stream = io.BytesIO(data)
    version = npy.read_magic(stream)
    read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, is_fortran, dtype = read_header(stream)
    if dtype.hasobject:
        return None
    # Taken from the bytes that are there, whatever size the header declares.
    flat = np.frombuffer(data, dtype, int(np.prod(shape)), stream.tell())
    return flat.reshape(shape, order="F" if is_fortran else "C")
