"""The compiled kinematics for controllers without a horizon."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from himpc.formulation.forms import StackForm
from himpc.references import Preview
from himpc.tasks import Damping, FrameOrientation, Task
from himpc.tick.configure import write_tasks
from himpc.tick.kernel.arrays import PULL, Array
from himpc.tick.kernel.control_period import LINEARIZE, NOT_FINITE, control_period
from robots import Robot

_NUDGES = 3
"""Number of states: the state itself, one before it and one after it."""


class Seen(NamedTuple):
    """Kinematics of the tasks at a state: J (m, n), J̇q̇ (m,) and the error x̃ (m,) of the solved tasks, and the
    value x and the error x̃ of every task by its name."""

    J: Array
    drift: Array
    error: Array
    values: dict[str, Array]
    errors: dict[str, Array]


class Kinematics:
    """The kinematics of a stack's tasks, all of which are built into the kernel.

    Args:
        robot: gives the geometry.
        form: the levels that are solved.
        off: tasks that are measured only.
    """

    def __init__(self, robot: Robot, form: StackForm, off: list[Task]) -> None:
        counts = [*form.sizes, *(len(task.coordinates(robot)) for task in off)]
        self._solved = sum(form.sizes)
        self._arena, self._spans = write_tasks(robot, (*form.tasks, *off), counts, _NUDGES, self._solved)
        self._arena.f["M_bar"][:], self._arena.f["scalars"][:], self._arena.i["known"][0] = 1.0, 1.0, 1
        self._arena.f["scalars"][PULL] = np.inf

    def at(self, q: Array, v: Array, h: float, previews: Mapping[str, Preview]) -> Seen:
        """Returns the kinematics of the tasks at a state.

        Args:
            q, v: (n,).
            h: s, time by which the joints are moved along v, forward and backward, for the difference of J.
            previews: of every task; only the present value is used.

        Raises:
            numpy.linalg.LinAlgError: a result is not finite.
        """
        f = self._arena.f
        f["q"][:], f["v"][:], f["path"][1] = q, v, q
        f["path"][2], f["path"][3] = q + h * v, q - h * v
        for index, task, span in self._spans:
            if not isinstance(task, Damping):
                value = previews[task.name].value
                if value.ndim == 2:
                    f["R_d"][index] = value
                else:
                    f["x_d"][span] = value
        if control_period(*self._arena.arguments, LINEARIZE, 0, 0.0) == NOT_FINITE:
            raise np.linalg.LinAlgError("the kinematics are not finite")
        J, ahead, behind = f["B"][:, : self._solved]
        R, value, error = f["R_now"].copy(), f["value"].copy(), f["error"].copy()
        return Seen(
            J.copy(),
            (ahead - behind) @ v / (2 * h),
            error[: self._solved],
            {
                task.name: R[index] if isinstance(task, FrameOrientation) else value[span]
                for index, task, span in self._spans
            },
            {task.name: error[span] for _, task, span in self._spans},
        )
