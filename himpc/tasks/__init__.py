"""Tasks: what a level asks the robot to do."""

from himpc.tasks.frame_orientation import FrameOrientation
from himpc.tasks.frame_position import FramePosition
from himpc.tasks.joints import Damping, Joints, Posture
from himpc.tasks.task import Task

__all__ = ["Damping", "FrameOrientation", "FramePosition", "Joints", "Posture", "Task"]
