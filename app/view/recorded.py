"""The recorded run of the first lesson, which a page shows while the controllers are compiled."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import numpy as np
import viser

from app.link.poses import LinkPoses
from app.view.robot import RobotView, aim
from robots import load_robot

_REST = 1.5
"""Time, s, for which the robot stands still at the end of the run, before the run is shown again."""


class RecordedRun:
    """The robot of the first lesson, moved as in a run that was recorded by `python -m docs.record`. It is
    removed with the rest of the scene when the page's own robot is there."""

    def __init__(self, client: viser.ClientHandle, phone: bool, now: float) -> None:
        """phone: see `aim`; now: the time, s, at which the run begins."""
        told: dict[str, Any] = json.loads(files("app.view").joinpath("recorded.json").read_text("utf-8"))
        robot = load_robot(told["robot"])
        self._q, self._period, self._began = np.array(told["q"]), float(told["period"]), now
        self._poses, self._view = LinkPoses(robot), RobotView(client.scene, robot, "/recorded")
        self._label = client.scene.add_label("/recorded/label", "a recorded run")
        aim(client.camera, robot, phone, np.empty((0, 3)))
        self.follow(now)

    def follow(self, now: float) -> None:
        """Shows the run at a time, s; it is repeated."""
        last = len(self._q) - 1
        t = (now - self._began) % (last * self._period + _REST)
        poses = self._poses.at(self._q[min(int(t / self._period), last)])
        assert poses is not None
        self._view.move(poses[:-1])
        self._label.position = poses[-1, :3] + (0.0, 0.0, 0.08)
