"""Both kinds of sessions as the simulation process drives them; the scene's kind chooses."""

from app.worker.reports.report import Run
from app.worker.reports.torque import TorqueRun
from app.worker.reports.velocity import VelocityRun
from lessons.kinds import AnyScene
from lessons.scenes.torque_scene import Scene

__all__ = ["Run", "TorqueRun", "VelocityRun", "start"]


def start(scene: AnyScene, seed: int) -> Run:
    """A scene from its beginning. Raises InputError if its settings do not fit its robot."""
    return TorqueRun(scene, seed) if isinstance(scene, Scene) else VelocityRun(scene, seed)
