"""The priority of the simulations' processes."""

from __future__ import annotations

import os
from contextlib import suppress

BEHIND = 10
"""A simulation has a niceness that is higher than the server's by this: pages are served first."""


def let_go_first(pid: int) -> None:
    """Gives a process a lower priority than this one."""
    with suppress(OSError):  # it has ended, or may not be changed
        os.setpriority(os.PRIO_PROCESS, pid, os.getpriority(os.PRIO_PROCESS, 0) + BEHIND)
