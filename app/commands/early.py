"""Imported before everything else: Ctrl-C while the first modules load ends without a traceback, too.

Nothing has been begun by then, so that nothing is left to be ended. What the interpreter itself does before
it comes here is beyond our reach.
"""

from __future__ import annotations

import os
import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, lambda *_: os._exit(130))

# Nothing here draws with MuJoCo. Its import would look for a window library, in processes of its own: half a
# second, and they hear of Ctrl-C before any code of ours could run in them.
os.environ.setdefault("MUJOCO_GL", "disable")


def main() -> int:
    """The console script."""
    from app.__main__ import main as run

    return run()
