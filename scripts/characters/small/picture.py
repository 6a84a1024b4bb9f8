# SPDX-License-Identifier: GPL-3.0-or-later
"""Small images as PNG files, whose bytes are the same on every machine: the data is stored, not compressed. No bpy."""

import struct
import zlib
from collections.abc import Callable, Sequence

COLOR_TYPES = {1: 0, 3: 2, 4: 6}  # PNG's number by channels
MOST_STORED = 65535  # bytes of a block of deflate's


def png(size: int, pixel: Callable[[float, float], Sequence[float]]) -> bytes:
    """Return a square image of `size` pixels a side.

    `pixel` returns the channels (1: gray, 3: RGB, 4: RGBA), each 0 to 1 as encoded in the file, at the middle of a pixel: u from
    the left and v from the top, 0 to 1.
    """
    rows = bytearray()
    channels = 0
    for y in range(size):
        rows.append(0)  # no filter
        for x in range(size):
            values = pixel((x + 0.5) / size, (y + 0.5) / size)
            channels = len(values)
            rows += bytes(min(max(round(255.0 * value), 0), 255) for value in values)
    header = struct.pack(">IIBBBBB", size, size, 8, COLOR_TYPES[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", _stored(bytes(rows))) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _stored(data: bytes) -> bytes:
    """Return `data` in the zlib format (RFC 1950), in blocks that are not compressed (RFC 1951, 3.2.4)."""
    out = bytearray(b"\x78\x01")
    for start in range(0, len(data), MOST_STORED):
        block = data[start : start + MOST_STORED]
        is_last = start + MOST_STORED >= len(data)
        out += struct.pack("<BHH", is_last, len(block), len(block) ^ 0xFFFF) + block
    return bytes(out + struct.pack(">I", zlib.adler32(data)))
