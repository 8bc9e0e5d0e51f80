"""The reports of a torque-level session."""

from __future__ import annotations

from typing import final

import numpy as np

from app.link.inside import Inside, InsideRequest
from app.link.messages import ContactPoint
from app.link.own_code import OwnCode
from app.worker.reports.own_code import File
from app.worker.reports.report import TOUCHING, SessionReport
from lessons.geometry.look import matrix_of, plane_of
from lessons.session.torque import TorqueSession
from robots import InputError, convergence_eigenvalues, convergence_gauge
from robots.world import World


@final
class TorqueRun(SessionReport):
    """The data of a torque-level session, see `app.worker.reports.report.SessionReport`."""

    session: TorqueSession

    def __init__(self, session: TorqueSession) -> None:
        super().__init__(session)
        self._file = File()

    def own(self) -> OwnCode | None:
        return self._file.look(self.session)

    def targets(self) -> dict[str, np.ndarray]:
        found = {task.name: self.session.target(task.name) for task in self.session.layout.tasks}
        return {name: np.array(target.raw) for name, target in found.items() if target is not None}

    def path(self) -> np.ndarray:
        return np.array(self.session.predicted_path())

    def ranks(self) -> dict[str, tuple[int, int]]:
        finite = np.isfinite(self.session.plant.q).all()
        return self.session.ranks() if finite else {}

    def world(self) -> World:
        return self.session.scene.world

    def contacts(self) -> tuple[ContactPoint, ...]:
        found = self.session.plant.contacts[:TOUCHING]
        return tuple(ContactPoint(each.between, _point(each.position), _point(each.force)) for each in found)

    def objects(self) -> np.ndarray:
        return self.session.plant.objects()

    def nearest(self) -> str:
        return self.session.clearance.nearest.pair

    def gauge(self) -> tuple[float, float] | None:
        found = self._mechanics()
        return None if found is None else convergence_gauge(*found)

    def inside(self) -> Inside | None:
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
