"""What scripts import that were written before `lessons` itself had all of it."""

from lessons import arrays, load_scene, prepared, run, scene_named, summary, with_tasks

__all__ = ["arrays", "load_scene", "prepared", "run", "scene_named", "summary", "with_tasks"]
