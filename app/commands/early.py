"""The first module that is imported. With it, Ctrl-C ends the program without a traceback also during the
other imports.

At that time, nothing is running that must be ended. A Ctrl-C before the import of this module cannot be
handled here.
"""

from __future__ import annotations

import os
import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, lambda *_: os._exit(130))

# No command draws with MuJoCo's own renderer. Without this line, MuJoCo's import would start processes that
# search for a window library. They take half a second, and Ctrl-C would reach them before our code.
os.environ.setdefault("MUJOCO_GL", "disable")
