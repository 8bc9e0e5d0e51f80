"""The file with which a class continues after its server was killed and started again. Only the user who
started the server can read it."""

from __future__ import annotations

import contextlib
import hashlib
import os
import socket
import sys
import threading
import time
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from app.classes.gathering import Gathering
from app.classes.hall import Hall
from app.classes.saved import SavedGathering, saved
from app.web.passes import Passes

PERIOD = 1.0
"""Shortest time, s, between two writings of the file."""
KEPT = 12 * 3600.0
"""Time, s, after which a class of a server that has ended does not continue any more."""
_TOUCH = 600.0  # s after which the file of a class in which nothing happens is written again
_SECRET = r"^[A-Za-z0-9_-]{16,200}\Z"
Secret = Annotated[str, Meta(pattern=_SECRET)]


class SavedClass(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A class with its secrets.

    Attributes:
        code: the phones' code; owner: the owner's secret; token: the token of the other pages, None if none
            is needed; key: the key of the cookies, as hexadecimal digits.
        state: the class.
    """

    code: Annotated[str, Meta(pattern=r"^[a-z0-9]{6}\Z")]
    owner: Secret
    token: Secret | None
    key: Annotated[str, Meta(pattern=r"^[0-9a-f]{64}\Z")]
    state: SavedGathering


class ClassFile:
    """The file of one class."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._written: Gathering | None = None  # the state that the file contains
        self._written_at = -_TOUCH
        self._complained = self._forgotten = False
        self._lock = threading.Lock()

    def read(self) -> SavedClass | None:
        """Returns the class that was saved; None if there is none, or if it is too old. Classes that are too
        old are deleted."""
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            for each in self._path.parent.glob("class-*"):
                if time.time() - each.lstat().st_mtime > KEPT:
                    each.unlink()
            with open(os.open(self._path, os.O_RDONLY | os.O_NOFOLLOW), "rb") as file:
                found = os.fstat(file.fileno())
                if found.st_uid != os.getuid() or found.st_mode & 0o077:
                    raise ValueError("other users can read or change it")
                return msgspec.json.decode(file.read(), type=SavedClass)
        except FileNotFoundError:
            return None
        except (OSError, ValueError, RecursionError) as error:  # ValueError: of msgspec, too
            self._complain(f"the class in {self._path} cannot be continued ({error}): a new class begins")
            return None

    def keep(self, hall: Hall, passes: Passes, now: bool = False) -> None:
        """Writes the class if it has changed. now: write at once, otherwise at most once in PERIOD."""
        with self._lock:
            state, passed = hall.state, time.monotonic() - self._written_at
            changed = state is not self._written and (now or passed >= PERIOD)
            if not self._forgotten and (changed or passed >= _TOUCH):
                self._written, self._written_at = state, time.monotonic()
                self._write(
                    SavedClass(hall.code, passes.owner or "", passes.token, passes.key.hex(), saved(state))
                )

    def _write(self, kept: SavedClass) -> None:
        beside = self._path.with_suffix(".new")
        try:
            with contextlib.suppress(FileNotFoundError):
                beside.unlink()
            with open(os.open(beside, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "wb") as file:
                file.write(msgspec.json.encode(kept))
            beside.replace(self._path)
        except OSError as error:
            self._complain(f"the class cannot be saved ({error}): it ends if this program is killed")

    def forget(self) -> None:
        """Deletes the file: the class has ended."""
        with self._lock, contextlib.suppress(OSError):
            self._forgotten = True
            self._path.unlink()

    def _complain(self, sentence: str) -> None:
        if not self._complained:
            self._complained = True
            print(f"himpc-lab: {sentence}", file=sys.stderr, flush=True)


def class_file(*command: object) -> ClassFile | None:
    """Returns the file for the class of a command on this machine; None if the user has no home folder.
    command: the parts of the command that a continued class must have in common."""
    try:
        folder = Path(os.environ.get("XDG_STATE_HOME") or Path("~/.local/state").expanduser())
    except RuntimeError:
        return None
    name = hashlib.sha256(repr((socket.gethostname(), *command)).encode()).hexdigest()[:16]
    return ClassFile(folder / "himpc-lab" / f"class-{name}.json")
