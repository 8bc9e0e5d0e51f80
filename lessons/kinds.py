"""Old import names, for scripts exported before version 0.2; no other code uses them."""

from lessons.recording.arrays import arrays as arrays_of
from lessons.recording.run import run as run_scene
from lessons.recording.summary import summary as summary_of
from lessons.scenes.catalog import load_scene as find_scene
from lessons.scenes.catalog import prepared

__all__ = ["arrays_of", "find_scene", "prepared", "run_scene", "summary_of"]
