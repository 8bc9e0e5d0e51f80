"""Starts a session together with the matching kind of report."""

from collections.abc import Mapping

from app.worker.reports.report import SessionReport
from app.worker.reports.torque import TorqueRun
from app.worker.reports.velocity import VelocityRun
from lessons.scenes.scene import Scene
from lessons.session.session import Session
from lessons.session.start import begin
from lessons.session.torque import TorqueSession
from lessons.session.velocity import VelocitySession

__all__ = ["SessionReport", "TorqueRun", "VelocityRun", "start"]

_REPORTS: Mapping[type[Session], type[SessionReport]] = {
    TorqueSession: TorqueRun,
    VelocitySession: VelocityRun,
}


def start(scene: Scene, seed: int) -> SessionReport:
    """Starts a scene from its beginning. Raises InputError if its settings do not fit its robot."""
    session = begin(scene, seed)
    return _REPORTS[type(session)](session)
