"""Task sequences for hierarchical-task control: the data of a mission, and the task manager."""

from himpc.missions.manager import Active, Progress, advanced, insert, move, release, remove, reorder
from himpc.missions.mission import Follow, Go, Mission, MissionTask
from himpc.missions.where import where

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
