"""The reports of a torque-level session, and the file of the user's own controller."""

from __future__ import annotations

import threading
from typing import Any, final

import numpy as np

from app.link.messages import ContactPoint, Inside, InsideRequest, OwnCode
from app.worker.report import SessionReport
from lessons.geometry.look import matrix_of, plane_of
from lessons.own.files import Stamp, is_file, read, stamp
from lessons.own.load import judged
from lessons.session.torque import TorqueSession
from robots import InputError, convergence_eigenvalues, convergence_gauge
from robots.world import World


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


TOUCHING = 24
"""Largest number of contact points sent to the page."""


@final
class TorqueRun(SessionReport):
    """The data of a torque-level session, see `app.worker.report.SessionReport`."""

    session: TorqueSession

    def __init__(self, session: TorqueSession) -> None:
        super().__init__(session)
        self._file = File()

    def extras(self, running: bool, ran: bool) -> dict[str, Any]:
        session, mechanics = self.session, None if running else self._mechanics()
        touching = session.plant.contacts[:TOUCHING]
        return {
            "gauge": None if mechanics is None else convergence_gauge(*mechanics),
            "inside": self._inside() if ran else None,
            "own": self._file.look(session),
            "ranks": session.ranks() if np.isfinite(session.plant.q).all() else {},
            "contacts": tuple(
                ContactPoint(each.between, _point(each.position), _point(each.force)) for each in touching
            ),
            "objects": session.plant.objects(),
            "nearest": session.clearance.nearest.pair,
        }

    def targets(self) -> dict[str, np.ndarray]:
        found = {task.name: self.session.target(task.name) for task in self.session.layout.tasks}
        return {name: np.array(target.raw) for name, target in found.items() if target is not None}

    def path(self) -> np.ndarray:
        return np.array(self.session.predicted_path())

    def world(self) -> World:
        return self.session.scene.world

    def _inside(self) -> Inside | None:
        session, watch = self.session, self.watch
        if watch == InsideRequest():
            return None
        mechanics = self._mechanics() if watch.spectrum else None
        spectrum = None if mechanics is None else convergence_eigenvalues(*mechanics)
        n = session.robot.n
        try:
            plane = None
            if watch.plane is not None and min(watch.plane) >= 0 and max(watch.plane) < n:
                plane = plane_of(session, watch.plane, watch.through, watch.shift)
            matrix = None if watch.matrix is None else matrix_of(session, watch.matrix)
        except InputError as error:
            return Inside(spectrum=spectrum, why_not=str(error))
        return Inside(plane, matrix, spectrum)

    def _mechanics(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Returns the plant's M and the controller's M̄; None if the state is not finite."""
        session = self.session
        if not np.isfinite(session.plant.q).all():
            return None
        return session.plant.mass_matrix(), session.M_bar


def _point(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
