"""The file of the user's own controller. Its code takes effect when the file is saved."""

from __future__ import annotations

import os
import threading

from app.link.own_code import OwnCode
from lessons.own.files import is_file, read
from lessons.own.judge import judged
from lessons.session.torque import TorqueSession
from robots import InputError

Stamp = tuple[str, int, int]
"""The stamp of a file: its path, time and size. If the stamp changes, the file was saved."""


class File:
    """Checks the file at each call of `look`. A new version is first tested on a thread, which takes a
    second. Then it replaces the running code without a jump in torque. If the new version has a fault, the
    running code continues."""

    def __init__(self) -> None:
        self._stamp: Stamp | None = None
        self._saves = 0
        self._taken_at = 0.0
        self._fault: str | None = None
        self._judging: threading.Thread | None = None

    def look(self, session: TorqueSession) -> OwnCode | None:
        """Checks the file and returns its state; None if the controller is one of the lab's own."""
        path = str(session.settings.controller)
        if not is_file(path):
            self._stamp = None
            return None
        if self._judging is not None and not self._judging.is_alive():
            self._judging = None
            self._take(session)
        stamp = _stamp(path)
        if self._stamp is None or self._stamp[0] != path:
            self._stamp, self._fault = stamp, None
        elif stamp is not None and stamp != self._stamp and self._judging is None:
            self._stamp = stamp
            self._judging = threading.Thread(target=self._judge, args=(path,), daemon=True)
            self._judging.start()
        return OwnCode(path, self._fault or session.failure, self._saves, self._taken_at)

    def _judge(self, path: str) -> None:
        try:
            judged(read(path))
            self._fault = None
        except InputError as error:
            self._fault = f"{error}. The previous code continues to run."

    def _take(self, session: TorqueSession) -> None:
        if self._fault is not None:
            return
        try:
            session.renew()
        except InputError as error:
            self._fault = f"{error}. The previous code continues to run."
        else:
            self._saves, self._taken_at = self._saves + 1, session.t


def _stamp(path: str) -> Stamp | None:
    """Returns the stamp of a file; None while the file does not exist. This happens for a moment while the
    file is saved."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return path, found.st_mtime_ns, found.st_size
