"""Shared memory between the simulation (one writer) and the page (readers): telemetry rows and poses.

Data are not pickled, and no process waits. The writer fills a row, then increments the count. Readers read
only rows below the count. They leave out the oldest rows, which may be overwritten meanwhile.
"""

from __future__ import annotations

import contextlib
import errno
import mmap
import os
import tempfile
from typing import TYPE_CHECKING

import numpy as np

from robots import InputError

if TYPE_CHECKING:
    from robots import Robot

MAX_ROWS = 8192
MIN_ROWS = 1024
"""Number of rows of about one second of ticks. With fewer rows, a page that is briefly late would miss
rows."""
_MAX_BYTES = 12_000_000  # of each session
_MARGIN = 256  # rows the writer may add while a reader copies
_HEAD = 64  # bytes


class Block:
    """A ring of telemetry rows (width float64) and the poses of all joints and the tip, (J, 7):
    position, m, and quaternion wxyz. The memory has no name, so it is freed when the last process that
    uses it ends for any reason."""

    def __init__(self, width: int, bodies: int, file: int | None = None) -> None:
        """Creates the memory, as large as the machine allows, or attaches to the memory of an
        open file and closes the file. Raises InputError if the memory is too small for MIN_ROWS."""
        row, rest = 8 * width, _HEAD + 8 * 7 * bodies
        self._file = _allocated(row, rest) if file is None else file
        self._memory = mmap.mmap(self._file, 0)
        self.rows = (len(self._memory) - rest) // row
        if file is not None:
            self._close_file()
        self._head = np.ndarray((8,), np.int64, self._memory)
        self._time = np.ndarray((1,), np.float64, self._memory, 56)
        self._ring = np.ndarray((self.rows, width), np.float64, self._memory, _HEAD)
        self._poses = np.ndarray((bodies, 7), np.float64, self._memory, _HEAD + row * self.rows)

    @classmethod
    def for_robot(cls, robot: Robot, width: int, file: int | None = None) -> Block:
        return cls(width, robot.model.njoints, file)

    @property
    def file(self) -> int:
        """The open file for the other process. Only the process that created the memory has it."""
        return self._file

    @property
    def count(self) -> int:
        return int(self._head[0])

    def write(self, row: np.ndarray) -> None:
        count = int(self._head[0])
        self._ring[count % self.rows] = row
        self._head[0] = count + 1

    def write_poses(self, poses: np.ndarray, t: float = 0.0) -> None:
        """t: the simulated time of the poses, s."""
        self._head[1] += 1  # odd: a write is in progress
        self._poses[:] = poses
        self._time[0] = t
        self._head[1] += 1

    def poses(self) -> np.ndarray:
        return self.moment()[1]

    def moment(self) -> tuple[float, np.ndarray]:
        """Returns (simulated time in s, poses) of one instant. In the unlikely case of three failed attempts,
        the result may mix two instants."""
        t, copy = float(self._time[0]), self._poses.copy()
        for _ in range(3):
            before = int(self._head[1])
            t, copy = float(self._time[0]), self._poses.copy()
            if before % 2 == 0 and before == int(self._head[1]):
                break
        return t, copy

    def since(self, count: int) -> tuple[int, np.ndarray]:
        """Returns (index of the first row, copies of the rows) from row `count` on, without the rows that may
        have been overwritten."""
        end = self.count
        first = max(count, end - self.rows + _MARGIN, 0)
        return first, self._ring[np.arange(first, end) % self.rows]

    def close(self) -> None:
        del self._head, self._time, self._ring, self._poses
        self._memory.close()
        self._close_file()

    def _close_file(self) -> None:
        file, self._file = self._file, -1
        if file >= 0:
            os.close(file)


def _allocated(row: int, rest: int) -> int:
    """Creates an unnamed file in memory, with as many rows as fit into memory. All its memory is allocated
    now: if memory ran out at a later write, the process would end."""
    rows = max(MIN_ROWS, min(MAX_ROWS, _MAX_BYTES // row))
    file = _unnamed()
    while True:
        try:
            _set_aside(file, rest + rows * row)
            return file
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.ENOMEM, errno.EFBIG, errno.EDQUOT) or rows == MIN_ROWS:
                os.close(file)
                size = (rest + rows * row) / 1e6
                raise InputError(
                    f"There is no memory for the telemetry of this robot ({size:.1f} MB; {error.strerror}): "
                    "end other programs or sessions, or give the container more."
                ) from None
            with contextlib.suppress(OSError):
                os.ftruncate(file, 0)
            rows = max(MIN_ROWS, rows // 2)


def _unnamed() -> int:
    if hasattr(os, "memfd_create"):
        return os.memfd_create("himpc-lab")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


def _set_aside(file: int, size: int) -> None:
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file, 0, size)
        return
    for start in range(0, size, 1 << 20):
        os.pwrite(file, bytes(min(1 << 20, size - start)), start)
