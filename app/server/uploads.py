"""Uploads of one page: each is accepted as a whole or refused with one sentence."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import msgspec

from app.server.budget import UPLOADS, Budget

TRANSFER = b"FileTransfer"
"""Every message that begins or carries a file contains these bytes."""
_REMEMBERED = 64  # number of refused uploads that are stored, since parts of them may still arrive


class _Transfer(msgspec.Struct):
    """The decoded fields of an upload message, without the file's bytes."""

    transfer_uuid: str = ""
    size_bytes: int = 0


class Uploads:
    """The uploads of one page.

    Args:
        unfinished: returns the number of bytes of the page's incomplete files.
        forget: discards the received parts of a file.
        say: shows the user that a file was too large.
    """

    def __init__(
        self, unfinished: Callable[[], int], forget: Callable[[str], None], say: Callable[[], None]
    ) -> None:
        self._unfinished, self._forget, self._say = unfinished, forget, say
        self._refused: deque[str] = deque(maxlen=_REMEMBERED)

    def takes(self, raw: bytes, budget: Budget) -> bool:
        """Returns whether a message that begins or carries a file may be passed on."""
        try:
            part = msgspec.msgpack.decode(raw, type=_Transfer)
        except msgspec.DecodeError:
            part = _Transfer()
        if part.transfer_uuid in self._refused:
            return False
        if part.size_bytes <= UPLOADS and budget.uploads(len(raw), self._unfinished):
            return True
        self._refused.append(part.transfer_uuid)
        self._forget(part.transfer_uuid)
        self._say()
        return False
