"""Universal binaries of macOS: one file that holds a Mach-O image for each processor."""

from __future__ import annotations

import struct
from collections.abc import Sequence

_FAT_MAGIC = 0xCAFEBABE
_IMAGE_MAGIC = 0xFEEDFACF
# Images must begin on a page, and pages of arm64 have 16 KiB.
_PAGE_POWER = 14


def universal(images: Sequence[bytes]) -> bytes:
    """One universal binary of 64-bit Mach-O images.

    An image is kept as it is: its code signature covers its own bytes only, so it stays valid.

    Raises
    ------
    ValueError   If an image is not 64-bit Mach-O.
    """
    page = 1 << _PAGE_POWER
    header = struct.pack(">II", _FAT_MAGIC, len(images))
    binary = bytes(page)
    for image in images:
        magic, processor, variant = struct.unpack_from("<III", image)
        if magic != _IMAGE_MAGIC:
            raise ValueError(f"an image must begin with the magic number {_IMAGE_MAGIC:#x}, got {magic:#x}")
        binary += bytes(-len(binary) % page)
        header += struct.pack(">IIIII", processor, variant, len(binary), len(image), _PAGE_POWER)
        binary += image
    return header + binary[len(header) :]
