"""Restricts the process of a submission before its code runs, as far as the operating system allows."""

from __future__ import annotations

import ctypes
import importlib.abc
import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from errno import ENOSYS, ENOTTY, EPERM
from functools import partial
from pathlib import Path
from typing import Any

LAB = ("robots", "himpc", "lessons", "app", "himpc_lab")
HANDED = ("himpc", "himpc.qp")
"""The modules of the lab that a solution may import."""
_PARENT_DIES = 1  # PR_SET_PDEATHSIG of Linux
_LIBRARIES = ("/usr/lib", "/usr/lib64", "/lib", "/lib64", "/usr/local/lib")
_SINGLE = (
    "/etc/ld.so.cache",
    "/etc/localtime",
    "/dev/null",
    "/dev/urandom",
    "/dev/zero",
    "/usr/share/zoneinfo",
)
_CHANGING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_EVENTS = ("socket.", "subprocess.", "os.system", "os.exec", "os.fork", "os.posix_spawn", "os.kill",
           "os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.truncate", "os.link", "os.symlink",
           "os.chmod", "os.chown", "os.putenv", "os.utime", "os.setxattr", "os.removexattr", "shutil.",
           "webbrowser.", "signal.pthread_kill", "pty.", "ctypes.dlsym")  # fmt: skip
ALLOWED = (
    # memory; code that a program writes into its memory can make the calls of this list only
    *("brk", "mmap", "munmap", "mremap", "mprotect", "madvise"),
    # its own threads and signals; `clone` and `tgkill` are in `_ARGUMENTS`
    *("futex", "set_robust_list", "rseq", "sched_yield", "sigaltstack", "rt_sigaction", "rt_sigprocmask"),
    *("rt_sigreturn", "restart_syscall", "exit", "exit_group"),
    # time and random numbers
    *("clock_gettime", "clock_getres", "clock_nanosleep", "nanosleep", "gettimeofday", "time", "getrandom"),
    # open files: the pipes of the lab, and files that an import has opened for reading
    *("read", "readv", "pread64", "write", "writev", "lseek", "close", "dup"),
    # imports look for files; this shows names, sizes and times, and no content
    *("stat", "lstat", "fstat", "newfstatat", "statx", "access", "faccessat", "faccessat2", "readlink"),
    *("readlinkat", "getdents64", "getcwd"),
    # facts about the process and the machine
    *("getpid", "getppid", "gettid", "getuid", "geteuid", "getgid", "getegid", "getrlimit", "getrusage"),
    *("times", "uname", "sysinfo", "getcpu", "sched_getaffinity"),
)
"""The system calls that Python, NumPy, SciPy and imports need. Every other call ends the process."""
UNANSWERED = {
    ENOSYS: ("clone3", "openat2"),  # a filter cannot read their flags; the C library then uses older calls
    ENOTTY: ("ioctl",),  # Python asks every file that it opens whether it is a terminal
    EPERM: ("prctl", "mbind", "get_mempolicy", "set_mempolicy", "statfs"),  # OpenBLAS and the C library try
}
"""Calls that libraries try and can do without: they return this error and do nothing."""
_THREAD, _NAMESPACES = 0x10100, 0x7E020000  # CLONE_THREAD | CLONE_VM; every CLONE_NEW… that `clone` takes
_INT = 0xFFFFFFFF
_FCNTL = (1, 2, 3, 1030)  # F_GETFD, F_SETFD, F_GETFL, F_DUPFD_CLOEXEC


def ends_with(parent: int) -> None:
    """Makes this process end when its parent ends (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DIES, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


def limited(memory: int) -> None:
    """Limits this process: it has at most `memory` bytes, writes no files, and ignores Ctrl and C."""
    if sys.platform != "win32":
        import resource

        signal.signal(signal.SIGINT, signal.SIG_IGN)
        for what, most in (
            (resource.RLIMIT_CORE, 0),
            (resource.RLIMIT_FSIZE, 0),
            (resource.RLIMIT_AS, memory),
        ):
            hard = resource.getrlimit(what)[1]
            most = most if hard == resource.RLIM_INFINITY else min(most, hard)
            with suppress(ValueError, OSError):  # macOS has no limit of the address space
                resource.setrlimit(what, (most, most))


def readable() -> list[Path]:
    """Returns the paths that imports of a solution may read: Python, libraries, and installed packages except
    the lab's."""
    paths = [Path(name) for name in _SINGLE]
    folders = [Path(name) for name in (*sys.path, *(f"{base}/lib" for base in (sys.base_prefix, sys.prefix)))]
    for folder in dict.fromkeys((*folders, *map(Path, _LIBRARIES))):
        with suppress(OSError):
            paths += (path for path in folder.iterdir() if not _hidden(path))
    return [path for path in dict.fromkeys(paths) if path.exists()]


def _hidden(path: Path) -> bool:
    """Returns whether an entry of a folder is left out. Entries that are left out are the lab itself, tests,
    and folders of packages; the entries of these folders are checked one by one."""
    name = path.name
    return name in (*LAB, "site-packages", "dist-packages") or name.startswith(("python", "tests"))


def confine(paths: Sequence[Path]) -> Callable[[], tuple[str, ...]]:
    """Removes this process's access to files until the process ends, except reading in `paths`. Returns the
    function with which a copy of this process then also removes its access to all system calls that a
    computation does not need. The result of that function is the names of the mechanisms of the operating
    system that enforce this."""
    calls = _calls()  # Landlock would prevent the search for seccomp's library
    landlock = ("Landlock",) if _files(paths) else ()
    return lambda: (*landlock, "seccomp") if calls() else landlock


def _files(paths: Sequence[Path]) -> bool:
    """Forbids, by Landlock, reading outside `paths`, all writing, signals to other processes and TCP.
    Returns whether this was possible."""
    try:
        from py_landlock import AccessFs, Landlock
    except ImportError:
        return False
    try:
        rules = Landlock(strict=False)
        for path in paths:
            reading = AccessFs.READ_FILE | AccessFs.READ_DIR if path.is_dir() else AccessFs.READ_FILE
            rules.add_path_rule(path, access=reading)
        for folder in filter(os.path.isdir, sys.path):
            rules.add_path_rule(folder, access=AccessFs.READ_DIR)  # an import lists the entries
        rules.apply()
    except Exception:  # the reasons differ between kernels, containers and versions
        return False
    return True


def _calls() -> Callable[[], bool]:
    """Loads seccomp, and returns the function that applies it."""
    try:
        import pyseccomp
    except (ImportError, RuntimeError, OSError):
        return lambda: False
    return partial(_computing_only, pyseccomp)


def _computing_only(sec: Any) -> bool:
    """Makes the kernel end this process at every system call except those of `ALLOWED` and `UNANSWERED`, and
    a few calls with certain arguments. Returns whether this was possible."""

    def argument(index: int, bits: int, value: int) -> Any:
        return sec.Arg(index, sec.MASKED_EQ, bits, value)

    reading = _CHANGING | getattr(os, "O_PATH", 0)
    rules = [
        *((sec.ALLOW, name) for name in ALLOWED),
        *((sec.ERRNO(error), name) for error, names in UNANSWERED.items() for name in names),
        (sec.ALLOW, "openat", argument(2, reading, 0)),
        (sec.ALLOW, "open", argument(1, reading, 0)),
        (sec.ALLOW, "clone", argument(0, _THREAD | _NAMESPACES, _THREAD)),
        (sec.ALLOW, "tgkill", argument(0, _INT, os.getpid())),  # abort()
        (sec.ALLOW, "prlimit64", argument(0, _INT, 0), sec.Arg(2, sec.EQ, 0)),  # asks, and sets nothing
        *((sec.ALLOW, "fcntl", argument(1, _INT, command)) for command in _FCNTL),
    ]
    try:
        syscall_filter = sec.SyscallFilter(sec.KILL_PROCESS)
        for action, name, *arguments in rules:
            with suppress(OSError, ValueError):  # not every processor has all of these calls
                syscall_filter.add_rule(action, name, *arguments)
        syscall_filter.load()
    except Exception:
        return False
    return True


class _Hidden(importlib.abc.MetaPathFinder):
    """An import finder that refuses the lab's modules with a message."""

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> None:
        if fullname.partition(".")[0] in LAB:
            raise ImportError(
                f"{fullname} cannot be imported during grading: use installed packages and himpc.qp only"
            )


def hide_the_lab() -> None:
    """Makes every import of the lab's modules fail from now on, except those in `HANDED`."""
    for name in [name for name in sys.modules if name.partition(".")[0] in LAB and name not in HANDED]:
        del sys.modules[name]
    sys.meta_path.insert(0, _Hidden())


def refuse(paths: Sequence[Path], pipe: int) -> None:
    """Makes Python end this process when any thread does one of these: open a file that no import reads,
    start a program, send a signal, change a file, or use the network. `pipe` then names the action.
    This is needed where the operating system does not refuse these actions. By itself it does not stop
    hostile code."""
    archives = (path for path in sys.path if not os.path.isdir(path))
    allowed = tuple(os.path.realpath(str(path)) for path in (*paths, *archives))
    # A submission may replace these functions in their modules.
    end, write, real, text = os._exit, os.write, os.path.realpath, os.fsdecode

    def hook(event: str, arguments: Sequence[Any]) -> None:
        if event == "open":
            path, mode, flags = arguments
            if isinstance(path, int):
                return
            writing = bool(set("wax+") & set(mode or "")) or bool((flags or 0) & _CHANGING)
            if not writing and real(text(path)).startswith(allowed):
                return
            if not writing and str(path).endswith(".py"):  # Python opens the file of an error to quote a line
                raise PermissionError(f"a submission may not read {path}")
        elif not event.startswith(_EVENTS):
            return
        what = " ".join((event, *(f"{first:.60}" for first in arguments[:1] if isinstance(first, str))))
        try:
            write(pipe, what.encode(errors="replace"))
        finally:
            end(1)

    sys.addaudithook(hook)
