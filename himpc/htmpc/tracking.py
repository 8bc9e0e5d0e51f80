"""The levels of the controller: errors (6), tracking costs (8) and lexicographic constraints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from himpc.htmpc.kinematics import Desired, Knots
from himpc.htmpc.settings import HTMPCSettings
from himpc.stack import Level
from himpc.tasks import Task
from robots import InputError, Robot
from robots.arrays import Array


@dataclass(frozen=True, eq=False)
class Tracking:
    """One level with its weights at every knot.

    Attributes:
        name: name of the level.
        tasks: tasks of the level.
        coordinates: (m,), the task and the axis of each coordinate.
        Q: (N, m) diagonal weights at knots 1 … N; the last row is P. Knot 0 has no weights: it is measured,
            and its cost is constant.
    """

    name: str
    tasks: tuple[Task, ...]
    coordinates: tuple[str, ...]
    Q: Array

    def errors(self, knots: Knots, desired: dict[str, Desired]) -> Array:
        """Returns e of (6) at knots 1 … N, (N, m)."""
        parts = [knots.errors(task, desired[task.name][1:]) for task in self.tasks]
        return parts[0] if len(parts) == 1 else np.hstack(parts)

    def jacobian(self, knots: Knots, desired: dict[str, Desired]) -> Array:
        """Returns ∂e_k/∂q_k at knots 1 … N, (N, m, n)."""
        parts = [knots.jacobian(task, desired[task.name][1:]) for task in self.tasks]
        return np.ascontiguousarray(parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1))

    def cost(self, e: Array) -> float:
        """Returns J of (8) without its constant first term."""
        return 0.5 * float(np.vdot(self.Q * e, e))

    def guards(self, settings: HTMPCSettings) -> tuple[str, ...]:
        """Returns the names of the rows of (12) or (11) with which the levels below keep this level: the
        coordinates at knots 1 … N, or the cost."""
        if settings.lexicographic == "per_coordinate":
            return self.coordinates * settings.horizon
        return (f"cost of {self.name}",)


def tracking(robot: Robot, level: Level, settings: HTMPCSettings) -> Tracking:
    """Builds a level with its weights at every knot. Raises InputError for weights of the wrong length."""
    names = tuple(f"{task.name} {axis}" for task in level.tasks for axis in task.coordinates(robot))
    m = len(names)
    weight = np.asarray(level.Q, float)
    if weight.ndim and weight.shape != (m,):
        raise InputError(
            f"Q of level '{level.name}' has {weight.size} entries: its tasks have {m} coordinates"
        )
    Q = np.tile(np.broadcast_to(weight, (m,)), (settings.horizon, 1))
    Q[-1] *= settings.terminal
    return Tracking(level.name, level.tasks, names, Q)


def check_dimensions(robot: Robot, levels: tuple[Level, ...]) -> None:
    """Checks the rule of section III: the sum of the tasks' dimensions must be less than the degrees of
    freedom.

    Raises:
        InputError: the sum is too large, so that no freedom is left for the last level.
    """
    sizes = {level.name: sum(len(task.coordinates(robot)) for task in level.tasks) for level in levels}
    total = sum(sizes.values())
    if len(levels) > 1 and total >= robot.n:
        listed = " + ".join(f"{size} ('{name}')" for name, size in sizes.items())
        raise InputError(
            f"the tasks need {listed} = {total} coordinates, and this must be less than the {robot.n} "
            f"joints of '{robot.name}': switch a level off or control fewer axes"
        )


@dataclass(frozen=True, eq=False)
class Guard:
    """The errors that a level above has reached: the constraint (9c) for the levels below.

    Attributes:
        tracking: the level above.
        best: e* at knots 1 … N, (N, m).
    """

    tracking: Tracking
    best: Array

    @cached_property
    def reached(self) -> Array:
        """|e*|, (N, m)."""
        return np.abs(self.best)

    def excess(self, e: Array, per_coordinate: bool, delta: float) -> float:
        """Returns the largest h_i − δ_i of (13), which is ≤ 0 if a step is allowed.

        For (12), h = |e| − |e*| in every coordinate and knot. For (11), h = J − J*, with δ_J = ½ Σ w δ².
        """
        if per_coordinate:
            return float((np.abs(e) - self.reached).max()) - delta
        cost = self.tracking.cost
        return cost(e) - cost(self.best) - 0.5 * float(self.tracking.Q.sum()) * delta**2

    def gap(self, e: Array, strict: bool = False) -> float:
        """Returns the amount by which (11) allows the cost to grow from the cost of e. Unless `strict`, the
        amount is at least zero."""
        gap = self.tracking.cost(self.best) - self.tracking.cost(e)
        return gap if strict else max(gap, 0.0)
