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
        self._test: _Test | None = None

    def look(self, session: TorqueSession) -> OwnCode | None:
        """Checks the file and returns its state; None if the controller is one of the lab's own."""
        path = str(session.settings.controller)
        if not is_file(path):
            self._stamp = self._test = None
            return None
        stamp, test = _stamp(path), self._test
        if self._stamp is None or self._stamp[0] != path:
            # A test of the file before is not waited for: it says nothing about this file.
            self._stamp, self._fault, self._test = stamp, None, None
        elif stamp is not None and stamp != self._stamp and test is None:
            self._test = _Test(stamp)
            self._test.start()
        elif test is not None and not test.is_alive():
            self._test = None
            if stamp == test.stamp:  # otherwise the file was saved again, and is tested again
                self._stamp = stamp
                self._take(session, test.fault)
        return OwnCode(path, self._fault or session.failure, self._saves, self._taken_at)

    def _take(self, session: TorqueSession, fault: str | None) -> None:
        try:
            if fault is not None:
                raise InputError(fault)
            session.renew()
        except InputError as error:
            self._fault = f"{error}. The previous code continues to run."
        else:
            self._fault = None
            self._saves, self._taken_at = self._saves + 1, session.t


class _Test(threading.Thread):
    """The test of one version of a file; fault: the file's fault, None if it can be used."""

    def __init__(self, stamp: Stamp) -> None:
        super().__init__(daemon=True)
        self.stamp, self.fault = stamp, "The file could not be tested"

    def run(self) -> None:
        try:
            judged(read(self.stamp[0]))
            self.fault = None
        except InputError as error:
            self.fault = str(error)


def _stamp(path: str) -> Stamp | None:
    """Returns the stamp of a file; None while the file does not exist. This happens for a moment while the
    file is saved."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return path, found.st_mtime_ns, found.st_size
