"""Scenes, the session that runs them without a page, lessons, exercises and the papers' experiments."""

from typing import TYPE_CHECKING

from robots.lazy import lazily

if TYPE_CHECKING:
    from lessons.experiments.jobs import Job, perform_all
    from lessons.experiments.tune import chosen, tune
    from lessons.recording.arrays import arrays
    from lessons.recording.run import Recording, run
    from lessons.recording.summary import summary
    from lessons.runs.named import scene_named, with_tasks
    from lessons.scenes.catalog import load_scene, prepared, torque_scene
    from lessons.scenes.run_spec import RunSpec
    from lessons.session.start import begin

__all__ = [
    "Job",
    "Recording",
    "RunSpec",
    "arrays",
    "begin",
    "chosen",
    "load_scene",
    "perform_all",
    "prepared",
    "run",
    "scene_named",
    "summary",
    "torque_scene",
    "tune",
    "with_tasks",
]

__getattr__ = lazily("lessons")
