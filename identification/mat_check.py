"""Whether a MAT file is whole: scipy's reader can end the process on a damaged one."""

from __future__ import annotations

import struct
import zlib

_MATRIX, _COMPRESSED = 14, 15
_KINDS = frozenset((1, 2, 3, 4, 5, 6, 7, 9, 12, 13, _MATRIX, 16, 17, 18))
_HEADER = 128
_MOST = 1_000_000_000  # bytes of one variable after it is unpacked
_DEEPEST = 20


def damage_of(content: bytes) -> str | None:
    """What is wrong with the blocks of a MAT file of version 5 to 7.

    Args:
        content: the file's bytes.

    Returns:
        What was found, in words; None where every block has a known kind and fits into its file.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[126:128])
    if order is None:
        return None  # version 4, or no MAT file at all: scipy tells
    at = _HEADER
    while at < len(content):
        if at + 8 > len(content):
            return f"half a block at byte {at}"
        kind, size = struct.unpack_from(order + "II", content, at)
        block = content[at + 8 : at + 8 + size]
        if len(block) < size:
            return f"a block at byte {at} that is cut short"
        if kind == _COMPRESSED:
            unpacked = _unpacked(block)
            if unpacked is None or (found := _damage(unpacked, order, 0)) is not None:
                return f"a packed block at byte {at} that is damaged"
        elif kind != _MATRIX:
            return f"a block of unknown kind {kind} at byte {at}"
        elif (found := _damage(block, order, 0)) is not None:
            return f"{found} in the block at byte {at}"
        at += 8 + size
    return None


def _unpacked(block: bytes) -> bytes | None:
    try:
        return zlib.decompressobj().decompress(block, _MOST)
    except zlib.error:
        return None


def _damage(block: bytes, order: str, depth: int) -> str | None:
    """What is wrong with the parts of one block."""
    at = 0
    while at < len(block):
        if at + 8 > len(block) or depth > _DEEPEST:
            return "half a part"
        kind, size = struct.unpack_from(order + "II", block, at)
        start = at + 8
        if kind >> 16:  # a small part: kind, size and data in eight bytes
            kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
        if kind not in _KINDS:
            return f"a part of unknown kind {kind}"
        if start + size > len(block) or (start == at + 4 and size > 4):
            return "a part that is cut short"
        if kind == _MATRIX:
            found = _damage(block[start : start + size], order, depth + 1)
            if found is not None:
                return found
        at = start + size
        at += -at % 8
    return None
