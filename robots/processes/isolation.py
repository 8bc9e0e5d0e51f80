"""Runs work on untrusted files in a separate process, with a deadline and a limit of memory."""

from __future__ import annotations

import ctypes
import os
import pickle
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path
from typing import NoReturn, TypeVar, final

from robots.errors import InputError, shortened

DEADLINE = 10.0  # time limit, s, including the start of the process
MEMORY = 1_000_000_000  # bytes of address space

_T = TypeVar("_T")
_PARENT_DIES = 1  # PR_SET_PDEATHSIG of Linux
_limited = False
PATIENCE = 10.0
"""Largest wall time of isolated work, as a multiple of its time limit."""


@dataclass(frozen=True)
class Allowance:
    """The time and memory that isolated work may use, and the words for its error message.

    Attributes:
        seconds: time limit, including the start of the process. The time in which the process waits for a
            core does not count, but the total time is at most `PATIENCE` times this limit.
        memory: largest address space in bytes.
        doing: the beginning of the error message.
        ended: the part of the error message that says how the process ended; "(why)" follows it.
        hint: advice for the user.
    """

    seconds: float
    memory: int = MEMORY
    doing: str = "reading it"
    ended: str = "ended the importer"
    hint: str = "check it with another tool"

    @property
    def too_long(self) -> str:
        return f"{self.doing} takes longer than {self.seconds:.0f} s; give a simpler one"

    @property
    def too_much(self) -> str:
        return f"{self.doing} needs more than {self.memory / 1e9:.0f} GB of memory; give a smaller one"

    def end(self, code: int) -> str:
        """Returns the error message for an exit code."""
        if code == -signal.SIGALRM:
            return self.too_long
        name = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return f"{self.doing} {self.ended} ({name}); {self.hint}"


class Fault(Exception):
    """Raised if isolated work did not finish. The message is the end of a sentence that describes the
    problem."""


def isolated(
    function: Callable[..., _T], *args: object, within: Allowance | None = None, copied: bool = False
) -> _T:
    """Returns function(*args), computed in a new process that ends with this one.

    The process is not a fork. It can be started from any thread, and from daemonic processes, which may not
    have children of `multiprocessing`.

    Args:
        function: a function of a module; the function, its arguments and its result must be picklable.
        args: arguments of the function.
        within: limits of time and memory; DEADLINE and MEMORY by default.
        copied: whether the process may start as a copy of this one (a fork), if the system allows this.
            Modules that are imported here are then available at once, and count towards the limit of memory.

    Raises:
        InputError: raised by the function.
        Fault: the process crashed, took too long or needed too much memory.
    """
    within = within or Allowance(DEADLINE)
    request = pickle.dumps((function, args))
    with _Copy(request, within) if copied and _copies() else _empty(within) as child:
        try:
            answer = _answer_of(child, request, within.seconds)
        except subprocess.TimeoutExpired:
            raise Fault(within.too_long) from None
        finally:
            child.kill()
            with suppress(OSError):
                os.killpg(child.pid, signal.SIGKILL)  # processes that the child started and did not end
    if child.returncode != 0 or not answer:
        raise Fault(within.end(child.returncode))
    result, fault, refusal = pickle.loads(answer)
    if refusal is not None:
        raise refusal
    if fault is not None:
        raise Fault(fault)
    return result


def inside() -> bool:
    """Returns whether this process is one that `isolated` started: its limits hold already."""
    return _limited


def threads() -> int:
    """Returns the number of threads of this process (Linux)."""
    return len(os.listdir("/proc/self/task"))


def _copies() -> bool:
    """Returns whether a fork is safe: on Linux, and with a single thread. On other systems, libraries fail
    after a fork. A forked process blocks if another thread holds a lock."""
    return sys.platform == "linux" and hasattr(os, "pidfd_open") and threads() == 1


def _empty(within: Allowance) -> subprocess.Popen[bytes]:
    folder = str(Path(__file__).parents[2])
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(dict.fromkeys((folder, *filter(None, sys.path)))),
        # Each thread of a matrix library reserves memory, which counts towards the limit.
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
    }
    limits = (str(os.getpid()), str(within.seconds), str(within.memory))
    return subprocess.Popen(
        (sys.executable, "-P", "-c", "from robots.processes.isolation import serve; serve()", *limits),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
    )


@final
class _Copy:
    """A fork of this process that answers one request. It has those methods of Popen that this module
    uses."""

    def __init__(self, request: bytes, within: Allowance) -> None:
        self.returncode = 1
        self._answer = os.memfd_create("answer")
        parent = os.getpid()
        self.pid = os.fork()
        if self.pid == 0:
            _be_a_copy(request, within, parent, self._answer)
        self._end = os.pidfd_open(self.pid)

    def __enter__(self) -> _Copy:
        return self

    def __exit__(self, *_: object) -> None:
        self.returncode = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        os.close(self._answer)
        os.close(self._end)

    def communicate(self, _: bytes | None, timeout: float) -> tuple[bytes, None]:
        if not wait((self._end,), timeout):
            raise subprocess.TimeoutExpired((), timeout)
        return os.pread(self._answer, os.fstat(self._answer).st_size, 0), None

    def kill(self) -> None:
        os.kill(self.pid, signal.SIGKILL)


def _be_a_copy(request: bytes, within: Allowance, parent: int, out: int) -> NoReturn:
    code = 1
    try:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        _restrict(within, parent)
        _let_go(out)
        with os.fdopen(out, "wb") as file:
            file.write(_answer(request, within))
        code = 0
    finally:
        os._exit(code)


def _let_go(out: int) -> None:
    """Closes all file descriptors of the copied process except one, and discards everything that is
    printed."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(nowhere, number)
    # Only open descriptors are closed. In containers there may be a billion possible descriptors, and a loop
    # over all of them would take too long.
    for number in map(int, os.listdir("/proc/self/fd")):
        if number > 2 and number != out:
            with suppress(OSError):  # the descriptor of the listing itself is closed already
                os.close(number)
    sys.stdin = os.fdopen(0, closefd=False)
    sys.stdout = os.fdopen(1, "w", encoding="utf-8", errors="replace", closefd=False)
    sys.stderr = os.fdopen(2, "w", encoding="utf-8", errors="replace", closefd=False)


def _answer_of(child: subprocess.Popen[bytes] | _Copy, request: bytes | None, seconds: float) -> bytes:
    """Returns the output of the process. Raises TimeoutExpired at the time limit, see `Allowance.seconds`."""
    began, longest, more = time.monotonic(), PATIENCE * seconds, seconds
    while True:
        try:
            return child.communicate(request, timeout=more)[0]
        except subprocess.TimeoutExpired:
            request = None  # sent once
            passed = time.monotonic() - began
            more = min(seconds + waited(child.pid), longest) - passed
            if more < 0.01 * seconds:
                raise


def waited(pid: int) -> float:
    """Returns the time, s, in which a process was ready to run but had no core (Linux; 0 on other
    systems)."""
    try:
        return int(Path(f"/proc/{pid}/schedstat").read_text().split()[1]) * 1e-9
    except (OSError, ValueError, IndexError):
        return 0.0


def is_stopped(pid: int) -> bool:
    """Returns whether a process is stopped by SIGSTOP or a debugger (Linux; False on other systems)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2][:1] in ("T", "t")
    except OSError:
        return False


def serve() -> None:
    """Main function of the child process: reads one request from standard input and writes one answer to
    standard output."""
    within = Allowance(float(sys.argv[2]), int(sys.argv[3]))
    _restrict(within, int(sys.argv[1]))
    # Compiled libraries may print to standard output; their text must not become part of the answer.
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        answer = _answer(sys.stdin.buffer.read(), within)
        out.write(answer)


def _answer(request: bytes, within: Allowance) -> bytes:
    """Returns the pickled tuple (result, fault, refusal). Fault and refusal are None if the work
    succeeded."""
    try:
        function, args = pickle.loads(request)
        return pickle.dumps((function(*args), None, None))
    except InputError as error:
        return pickle.dumps((None, None, error))
    except MemoryError:
        fault = within.too_much
    except RecursionError:
        fault = "it is nested too deeply; give a file with fewer nested elements"
    except Exception as error:
        fault = f"the import raised an error ({type(error).__name__}: {shortened(str(error), 100)})"
    return pickle.dumps((None, fault, None))


def _restrict(within: Allowance, parent: int) -> None:
    """Makes this process end when its parent ends, when the largest wall time has passed, and when the limit
    of memory is reached, as far as the system supports this."""
    global _limited
    _limited = True
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent notices this and ends the process
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(int(PATIENCE * within.seconds) + 1)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DIES, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)
    os.setsid()  # a new session, so that its children can be ended together with it
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    most = within.memory if hard == resource.RLIM_INFINITY else min(within.memory, hard)
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
