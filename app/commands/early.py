"""Imported first, so that Ctrl-C during the import of the other modules also ends without a traceback.

Nothing has been started by then that would have to be ended. A Ctrl-C that arrives before the interpreter
imports this module cannot be handled here.
"""

from __future__ import annotations

import os
import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, lambda *_: os._exit(130))

# Nothing here draws with MuJoCo. Its import would start processes that look for a window library. They take
# half a second, and Ctrl-C reaches them before our code can handle it.
os.environ.setdefault("MUJOCO_GL", "disable")


def main() -> int:
    """The entry point of the console script."""
    from app.__main__ import main as run

    return run()
