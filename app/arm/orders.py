"""Shared memory for the orders that a watcher gives to the loop of an arm. Neither process waits for the
other.

The watcher writes targets, and a counter that shows that it is still running. The loop reads the memory once
per period. If the watcher is writing at that moment, the loop reads again in the next period.
"""

from __future__ import annotations

import mmap
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

VALUES = 32
"""Largest number of values of a target."""
_WRITES, _BEAT, _STOP = range(3)


class Order(NamedTuple):
    """A target that was dragged: the index of the task, and the values as `himpc_set` takes them."""

    task: int
    values: Array


@final
class Orders:
    """The memory, which forked processes share. One process writes, the other one reads."""

    def __init__(self, tasks: int) -> None:
        """tasks: number of tasks."""
        memory = mmap.mmap(-1, 8 * (3 + tasks * (2 + VALUES)))
        self._head = np.ndarray((3,), np.int64, memory)
        self._counts = np.ndarray((tasks, 2), np.int64, memory, 24)
        self._values = np.ndarray((tasks, VALUES), np.float64, memory, 24 + 16 * tasks)
        self._taken = np.zeros(tasks, np.int64)
        self._seen = 0

    # ---------------------------------------------------------------- the watcher

    def beat(self) -> None:
        """Shows that the watcher is still running."""
        self._head[_BEAT] += 1

    def stop(self) -> None:
        """Asks the loop to end gently."""
        self._head[_STOP] = 1

    def drag(self, order: Order) -> None:
        """Moves a target. Only the latest order of each task counts."""
        size = len(order.values)
        self._head[_WRITES] += 1  # odd: a write is in progress
        self._values[order.task, :size] = order.values
        self._counts[order.task, 0] += 1
        self._counts[order.task, 1] = size
        self._head[_WRITES] += 1

    # ---------------------------------------------------------------- the loop

    @property
    def beats(self) -> int:
        """Number of times that the watcher has called `beat`."""
        return int(self._head[_BEAT])

    @property
    def stopped(self) -> bool:
        """Whether the loop must end."""
        return bool(self._head[_STOP])

    @property
    def taken(self) -> int:
        """Number of orders that `news` has returned, or that later orders have replaced."""
        return int(self._taken.sum())

    def news(self) -> list[Order]:
        """Returns the targets that were dragged since the last call; empty while the watcher is writing."""
        before = int(self._head[_WRITES])
        if before == self._seen or before % 2:
            return []
        counts, values = self._counts.copy(), self._values.copy()
        if int(self._head[_WRITES]) != before:
            return []
        moved = np.flatnonzero(counts[:, 0] != self._taken)
        self._taken, self._seen = counts[:, 0], before
        return [Order(int(task), values[task, : counts[task, 1]]) for task in moved]
