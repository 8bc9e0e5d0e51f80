"""The priority of the simulations' processes."""

from __future__ import annotations

import os
from contextlib import suppress

BEHIND = 10
"""The niceness of a simulation minus that of the server. Pages are thus served first."""


def let_go_first(pid: int) -> None:
    """Gives a process a lower priority than this one."""
    with suppress(OSError):  # the process has ended, or the system forbids the change
        os.setpriority(os.PRIO_PROCESS, pid, os.getpriority(os.PRIO_PROCESS, 0) + BEHIND)
