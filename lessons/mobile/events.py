"""Old import names, for scripts exported before version 0.2; no other code uses them."""

from lessons.events import Appear, InsertTask, Release, RemoveTask

__all__ = ["Appear", "InsertTask", "Release", "RemoveTask"]
