"""Task sequences for hierarchical-task control: the data of a mission, and the task manager."""

from himpc.missions.manager import Active, Progress, advanced, insert, move, release, remove, reorder, where
from himpc.missions.mission import Follow, Go, Mission, MissionTask

__all__ = [
    "Active",
    "Follow",
    "Go",
    "Mission",
    "MissionTask",
    "Progress",
    "advanced",
    "insert",
    "move",
    "release",
    "remove",
    "reorder",
    "where",
]
