"""Work on files of strangers in a process of its own, with a deadline and a limit of memory."""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from robots.errors import InputError, shortened

DEADLINE = 10.0  # s, the start of the process included
MEMORY = 1_000_000_000  # bytes of address space

_T = TypeVar("_T")
_PARENT_DIES = 1  # PR_SET_PDEATHSIG of Linux
_TOO_MUCH = f"reading it needs more than {MEMORY / 1e9:.0f} GB of memory; give a smaller one"
_TOO_LONG = f"reading it takes longer than {DEADLINE:.0f} s; give a simpler one"


class Fault(Exception):
    """Isolated work did not come to an end; says why, for the end of a sentence."""


def isolated(function: Callable[..., _T], *args: object) -> _T:
    """function(*args), run in a process that starts empty and ends with this one.

    A process of its own, not a fork: it works from any thread, and from daemonic processes, which may
    not have children of `multiprocessing`.

    Args:
        function: of a module; it, its arguments and its result must be picklable.
        args: of the function.

    Raises:
        InputError: the function raised it.
        Fault: it crashed, took longer than DEADLINE or needed more than MEMORY.
    """
    folder = str(Path(__file__).parents[1])
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(dict.fromkeys((folder, *filter(None, sys.path)))),
        # Each thread of a matrix library reserves memory that counts against the limit.
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
    }
    with subprocess.Popen(
        (sys.executable, "-P", "-c", "from robots.isolation import serve; serve()", str(os.getpid())),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
    ) as child:
        try:
            answer, _ = child.communicate(pickle.dumps((function, args)), timeout=DEADLINE)
        except subprocess.TimeoutExpired:
            raise Fault(_TOO_LONG) from None
        finally:
            child.kill()
    if child.returncode != 0 or not answer:
        raise Fault(_end(child.returncode))
    result, fault, refusal = pickle.loads(answer)
    if refusal is not None:
        raise refusal
    if fault is not None:
        raise Fault(fault)
    return result


def serve() -> None:
    """The child: one request from standard input, one answer to standard output."""
    _restrict(int(sys.argv[1]))
    # Compiled libraries print what they like; nothing of it may get into the answer.
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        answer = _answer(sys.stdin.buffer.read())
        out.write(answer)


def _answer(request: bytes) -> bytes:
    """Pickled (result, fault, refusal), one of which is not None unless the result is."""
    try:
        function, args = pickle.loads(request)
        return pickle.dumps((function(*args), None, None))
    except InputError as error:
        return pickle.dumps((None, None, error))
    except MemoryError:
        fault = _TOO_MUCH
    except RecursionError:
        fault = "it is nested too deeply; give a flatter one"
    except Exception as error:
        fault = f"the import failed on it ({type(error).__name__}: {shortened(str(error), 100)})"
    return pickle.dumps((None, fault, None))


def _restrict(parent: int) -> None:
    """Ends with the parent, at the deadline and at the limit of memory, as far as the system can do it."""
    if hasattr(signal, "alarm"):
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent hears of it and ends this process
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(int(DEADLINE) + 1)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DIES, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        most = MEMORY if hard == resource.RLIM_INFINITY else min(MEMORY, hard)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


def _end(code: int) -> str:
    if code == -getattr(signal, "SIGALRM", 0):
        return _TOO_LONG
    name = signal.Signals(-code).name if code < 0 else f"exit code {code}"
    return f"reading it ended the importer ({name}); check it with another tool"
