"""Old import names: scripts that were written before `lessons` exported these names import them here."""

from lessons import arrays, load_scene, prepared, run, scene_named, summary, with_tasks

__all__ = ["arrays", "load_scene", "prepared", "run", "scene_named", "summary", "with_tasks"]
