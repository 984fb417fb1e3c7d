"""Mach-O, the format of binaries of macOS: code signatures and universal binaries."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator, Sequence

_FAT_MAGIC = 0xCAFEBABE
_IMAGE_MAGIC = 0xFEEDFACF
_HEADER_SIZE = 32
# Images must begin on a page, and pages of arm64 have 16 KiB.
_PAGE_POWER = 14
# The load command that says where the signature is, and parts of a signature, which are big-endian.
_CODE_SIGNATURE = 0x1D
_CODE_DIRECTORY = 0xFADE0C02
_HASHES = {1: "sha1", 2: "sha256"}


def is_macho(image: bytes) -> bool:
    """Whether an image is 64-bit Mach-O."""
    return image[:4] == struct.pack("<I", _IMAGE_MAGIC)


def with_new_hashes(image: bytes) -> bytes:
    """An image some of whose bytes have been changed, with the hashes in its signature made to fit.

    The linker signs images for arm64 without a key ("ad hoc"): the signature lists hashes of the image's pages, and the
    system ends a program that meets a page with another hash. An image without a signature is returned unchanged.
    """
    signed = bytearray(image)
    for directory in _code_directories(image):
        hashes = struct.unpack_from(">I", image, directory + 16)[0]
        pages, end, size, kind, power = struct.unpack_from(">IIBBxB", image, directory + 28)
        for page in range(pages):
            content = image[page << power : min((page + 1) << power, end)]
            at = directory + hashes + page * size
            signed[at : at + size] = hashlib.new(_HASHES[kind], content).digest()[:size]
    return bytes(signed)


def _code_directories(image: bytes) -> Iterator[int]:
    """Where the lists of hashes begin."""
    commands = struct.unpack_from("<I", image, 16)[0]
    position = _HEADER_SIZE
    for _ in range(commands):
        command, size = struct.unpack_from("<II", image, position)
        if command == _CODE_SIGNATURE:
            signature = struct.unpack_from("<I", image, position + 8)[0]
            parts = struct.unpack_from(">I", image, signature + 8)[0]
            for k in range(parts):
                part = signature + struct.unpack_from(">I", image, signature + 12 + 8 * k + 4)[0]
                if struct.unpack_from(">I", image, part)[0] == _CODE_DIRECTORY:
                    yield part
        position += size


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
        if not is_macho(image):
            raise ValueError(f"an image must begin with the magic number {_IMAGE_MAGIC:#x}, got {image[:4].hex()}")
        _, processor, variant = struct.unpack_from("<III", image)
        binary += bytes(-len(binary) % page)
        header += struct.pack(">IIIII", processor, variant, len(binary), len(image), _PAGE_POWER)
        binary += image
    return header + binary[len(header) :]
