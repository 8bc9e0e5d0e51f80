"""Computes the rows of tasks that are not built into the kernel, in Python along the knots, and writes them
to the arena."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from himpc.kinematics.configuration import Configuration
from himpc.references import Preview
from himpc.tasks import FrameOrientation, OrientationTask, Task
from himpc.tasks.axes import AXES
from himpc.tasks.seen import at_rest, rests
from himpc.tick.configure import Span, is_built_in, write_motion
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.arrays import Array
from robots import Robot


class PythonRows:
    """The tasks for which `is_built_in` is false. Their rows are written to the arena before `linearize`
    reads them.

    Attributes:
        spans: the built-in tasks, whose rows the kernel computes itself.
        turning: names of the tasks whose value is a rotation matrix.
    """

    def __init__(self, robot: Robot, arena: Arena, spans: Sequence[Span]) -> None:
        self._robot, self._data, self._arena = robot, robot.model.createData(), arena
        self.spans = [entry for entry in spans if is_built_in(entry[1])]
        self._tasks: list[tuple[int, Task, slice, slice]] = []
        home = Configuration(robot, self._data, robot.home, np.zeros(robot.n))
        self.turning = {task.name for _, task, _ in spans if isinstance(task, FrameOrientation)}
        self._turned: dict[str, bool] = {}
        start = 0
        for index, task, span in spans:
            if not is_built_in(task):
                end = start + span.stop - span.start
                self._tasks.append((index, task, span, slice(start, end)))
                start = end
                if task.value(home).ndim == 2:
                    self.turning.add(task.name)

    def at_first(self, task: Task, preview: Preview) -> Preview:
        """Returns the preview that is written first: the argument itself or, for an orientation on fewer than
        three axes, a preview at rest. The motion of such a reference depends on the robot's configuration;
        `write` adds it."""
        if not isinstance(task, OrientationTask) or len(task.axes) == len(AXES):
            return preview
        self._turned[task.name] = not rests(preview)
        return at_rest(preview, len(task.axes))

    def write(self, previews: Mapping[str, Preview]) -> None:
        """For each task that is not built in, writes J at the knots of the last prediction (30), the value,
        the error and the reference. For orientations on fewer than three axes with a rotating reference, also
        writes the motion of the reference. The arena must already hold the measured state and the
        controller's memory.

        Args:
            previews: the previews of all tasks.
        """
        if not self._tasks and True not in self._turned.values():
            return
        turned = [entry for entry in self.spans if self._turned.get(entry[1].name)]
        f, known = self._arena.f, bool(self._arena.i["known"][0])
        q, v, path = f["q"], f["v"], f["path"]
        with np.errstate(all="ignore"):
            knots = path[2:] + (q - path[1])
            here = Configuration(self._robot, self._data, q, v, knots, previews)
            for _, task, span in turned:
                self._ask(span, task.reference_in_task_coordinates(here, previews[task.name]))
            past = Configuration(self._robot, self._data, f["q_was"], f["v_was"], previews=previews)
            for index, task, span, rows in self._tasks:
                f["python_jacobian"][: len(knots) + 1, rows] = task.jacobian(here)
                if not known:
                    f["python_jacobian"][-1, rows] = task.jacobian(past)[0]
                preview, value = previews[task.name], task.value(here)
                self._note(index, span, value)
                f["error"][span] = task.error(value, preview.value)
                self._ask(span, task.reference_in_task_coordinates(here, preview))

    def _note(self, index: int, span: slice, value: Array) -> None:
        if value.ndim == 2:
            self._arena.f["R_now"][index] = value
        else:
            self._arena.f["value"][span] = value

    def _ask(self, span: slice, reference: Preview) -> None:
        write_motion(self._arena, span, reference, len(self._arena.f["path"]))
