"""Running a velocity-level scene headless."""

from __future__ import annotations

from collections.abc import Callable

from lessons.recording.run import checked_duration, repeated
from lessons.recording.velocity import MobileRecording
from lessons.scenes.velocity_scene import MobileScene
from lessons.session.velocity import MobileSession


def mobile_run(
    scene: MobileScene,
    duration: float | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    to_the_end: bool = False,
) -> MobileRecording:
    """Runs a scene from its start to the end of its mission, or for at most its duration.

    Args:
        scene: what to run.
        duration: simulated seconds at most; None: the scene's own.
        seed: seed of the run.
        progress: called now and then with the share that is done.
        to_the_end: go on after the mission is done or control was lost, as the page does; otherwise the run
            ends there.

    Returns:
        the rows.
    """
    seconds = checked_duration(scene.duration if duration is None else duration)
    session = MobileSession(scene, seed)

    def ended() -> bool:
        return (session.diverged_at is not None or session.progress.done) and not to_the_end

    rows, wall_s = repeated(session.tick, lambda: session.settings.htmpc.period, seconds, ended, progress)
    return MobileRecording.of(session, rows, wall_s)
