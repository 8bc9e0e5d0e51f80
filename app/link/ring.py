"""Shared memory between the simulation (one writer) and the page (readers): telemetry rows and poses.

Nothing is pickled and nobody waits: the writer fills a row, then raises the count; readers look only at
rows behind the count and not so old that they might be overwritten meanwhile.
"""

from __future__ import annotations

from multiprocessing import shared_memory

import numpy as np

from robots import Robot

MAX_ROWS = 8192
_MAX_BYTES = 12_000_000  # containers often give /dev/shm 64 MB for all sessions together
_MARGIN = 256  # rows the writer may add while a reader copies
_HEAD = 64  # bytes


class Block:
    """A ring of telemetry rows (width float64) and the poses of joints 1 … n and the tip, (n + 1, 7):
    position, m, and quaternion wxyz."""

    def __init__(self, width: int, bodies: int, name: str | None = None) -> None:
        """Creates the memory, or attaches to the one called `name`."""
        self.rows = min(MAX_ROWS, _MAX_BYTES // (8 * width))
        size = _HEAD + 8 * (self.rows * width + bodies * 7)
        self._memory = shared_memory.SharedMemory(name=name, create=name is None, size=size)
        buffer = self._memory.buf
        self._head = np.ndarray((8,), np.int64, buffer)
        self._time = np.ndarray((1,), np.float64, buffer, 56)
        self._ring = np.ndarray((self.rows, width), np.float64, buffer, _HEAD)
        self._poses = np.ndarray((bodies, 7), np.float64, buffer, _HEAD + 8 * self.rows * width)
        if name is None:
            self._head[:] = 0

    @classmethod
    def for_robot(cls, robot: Robot, width: int, name: str | None = None) -> Block:
        return cls(width, robot.n + 1, name)

    @property
    def name(self) -> str:
        return self._memory.name

    @property
    def count(self) -> int:
        """Rows ever written."""
        return int(self._head[0])

    def write(self, row: np.ndarray) -> None:
        count = int(self._head[0])
        self._ring[count % self.rows] = row
        self._head[0] = count + 1

    def write_poses(self, poses: np.ndarray, t: float = 0.0) -> None:
        """t: the simulated time of the poses, s."""
        self._head[1] += 1  # odd: being written
        self._poses[:] = poses
        self._time[0] = t
        self._head[1] += 1

    def poses(self) -> np.ndarray:
        """A copy of the poses written last."""
        return self.moment()[1]

    def moment(self) -> tuple[float, np.ndarray]:
        """(simulated time in s, poses), not torn between two instants (or, in the unlikely fourth try, may
        be)."""
        t, copy = float(self._time[0]), self._poses.copy()
        for _ in range(3):
            before = int(self._head[1])
            t, copy = float(self._time[0]), self._poses.copy()
            if before % 2 == 0 and before == int(self._head[1]):
                break
        return t, copy

    def since(self, count: int) -> tuple[int, np.ndarray]:
        """(index of the first row, copies of the rows) from `count` on, as far as they are still there."""
        end = self.count
        first = max(count, end - self.rows + _MARGIN, 0)
        return first, self._ring[np.arange(first, end) % self.rows]

    def close(self, unlink: bool = False) -> None:
        """Detaches; `unlink` frees the memory once every process has detached."""
        del self._head, self._time, self._ring, self._poses
        self._memory.close()
        if unlink:
            self._memory.unlink()
