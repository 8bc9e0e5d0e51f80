"""The names that scripts exported before version 0.2 import; nothing else uses them."""

from lessons.events import Appear, InsertTask, Release, RemoveTask

__all__ = ["Appear", "InsertTask", "Release", "RemoveTask"]
