"""What a script of one's own needs, by one import: scenes, their runs, and what came out."""

from lessons.own.resolve import scene_named, with_tasks
from lessons.recording.arrays import arrays
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.catalog import load_scene, prepared

__all__ = ["arrays", "load_scene", "prepared", "run", "scene_named", "summary", "with_tasks"]
