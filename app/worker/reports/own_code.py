"""The file of the user's own controller. Its code takes effect when the file is saved."""

from __future__ import annotations

import threading

from app.link.own_code import OwnCode
from lessons.own.files import Stamp, is_file, read, stamp
from lessons.own.load import judged
from lessons.session.torque import TorqueSession
from robots import InputError


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
        saved, test = stamp(path), self._test
        if self._stamp is None or self._stamp[0] != path:
            # A test of the file before is not waited for: it says nothing about this file.
            self._stamp, self._fault, self._test = saved, None, None
        elif saved is not None and saved != self._stamp and test is None:
            self._test = _Test(saved)
            self._test.start()
        elif test is not None and not test.is_alive():
            self._test = None
            if saved == test.stamp:  # otherwise the file was saved again, and is tested again
                self._stamp = saved
                self._take(session, test.fault)
        return OwnCode(path, self._fault or session.failure, self._saves, self._taken_at)

    def _take(self, session: TorqueSession, fault: str | None) -> None:
        try:
            if fault is not None:
                raise InputError(fault)
            session.renew()
        except InputError as error:
            # A notification of the page keeps no columns: the wrong line with its caret is left out.
            self._fault = f"{str(error).partition(chr(10))[0]}. The previous code continues to run."
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
