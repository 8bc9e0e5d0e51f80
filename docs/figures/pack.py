"""Data for the browser: one script per pack. A page that is opened from a disk may load scripts, but no other
files."""

from __future__ import annotations

import base64
import gzip
import json
import math
from collections.abc import Sequence
from typing import Any

_LINE = 8
"""Each piece begins at a multiple of this number of bytes."""


class Pack:
    """A description and pieces of bytes. The description refers to a piece by its offset and its length in
    bytes."""

    def __init__(self) -> None:
        self._pieces = bytearray()

    def add(self, piece: bytes) -> tuple[int, int]:
        """Adds a piece and returns the reference to it."""
        self._pieces += bytes(-len(self._pieces) % _LINE)
        start = len(self._pieces)
        self._pieces += piece
        return start, len(piece)

    def script(self, name: str, told: dict[str, Any]) -> str:
        """Returns the script that gives the pack to the page. The pack consists of the length of the
        description (8 bytes), the description and the pieces."""
        text = json.dumps(told, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % _LINE)
        return wrapped(name, len(text).to_bytes(8, "little") + text + bytes(self._pieces))


def wrapped(name: str, content: bytes) -> str:
    """Returns the script that gives the compressed bytes to the page."""
    packed = base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()
    return f'(window.HIMPC_PACKS??={{}})["{name}"]="{packed}";\n'


def without_names(wasm: bytes) -> bytes:
    """Returns a WebAssembly module without its custom sections. These contain names and notes for debuggers,
    and a browser does not execute them. They are more than half of MuJoCo's module."""
    kept, at = bytearray(wasm[:8]), 8
    while at < len(wasm):
        size, shift, start, more = 0, 0, at + 1, True
        while more:
            size |= (wasm[start] & 0x7F) << shift
            more, shift, start = wasm[start] >= 0x80, shift + 7, start + 1
        if wasm[at] != 0:
            kept += wasm[at : start + size]
        at = start + size
    return bytes(kept)


def plain(values: Sequence[float]) -> list[float | None]:
    """Returns numbers for JSON; None for those that are not finite."""
    return [float(each) if math.isfinite(each) else None for each in values]
