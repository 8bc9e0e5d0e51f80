"""Restricts the process of a submission before its code runs, as far as the operating system allows."""

from __future__ import annotations

import ctypes
import importlib.abc
import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from errno import ENOSYS, EPERM
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
           "os.chmod", "os.chown", "os.putenv", "shutil.", "webbrowser.", "signal.pthread_kill",
           "pty.", "ctypes.dlsym")  # fmt: skip
_SYSCALLS = (
    # other processes
    *("fork", "vfork", "execve", "execveat", "ptrace", "process_vm_readv", "process_vm_writev"),
    *("kill", "tkill", "rt_sigqueueinfo", "rt_tgsigqueueinfo", "pidfd_open", "pidfd_send_signal"),
    *("pidfd_getfd", "process_madvise", "setpriority", "sched_setattr", "ioprio_set", "kcmp"),
    # the network and other means of communication besides a pipe
    *("socket", "socketpair", "io_uring_setup", "mq_open", "shmget", "semget", "msgget", "memfd_create"),
    # files
    *("creat", "mkdir", "mkdirat", "rename", "renameat", "renameat2", "unlink", "unlinkat", "rmdir", "link"),
    *("linkat", "symlink", "symlinkat", "chmod", "fchmod", "fchmodat", "chown", "fchown", "lchown"),
    *("fchownat", "truncate", "mknod", "mknodat", "open_by_handle_at", "utimensat", "setxattr"),
    # the system
    *("mount", "umount2", "unshare", "setns", "chroot", "pivot_root", "bpf", "userfaultfd"),
    *("perf_event_open", "keyctl", "add_key", "request_key", "reboot", "swapon", "init_module"),
    *("finit_module", "kexec_load", "setuid", "setgid", "setresuid", "setresgid", "setsid"),
)


class RefusedCalls(list[str]):
    """The calls that were refused, in order."""


def limited(memory: int, parent: int) -> None:
    """Limits this process: it ends with its parent, has at most `memory` bytes, and writes no files."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DIES, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)
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
    found = [Path(each) for each in _SINGLE]
    folders = [Path(each) for each in (*sys.path, *(f"{base}/lib" for base in (sys.base_prefix, sys.prefix)))]
    for folder in dict.fromkeys((*folders, *map(Path, _LIBRARIES))):
        with suppress(OSError):
            found += (each for each in folder.iterdir() if not _hidden(each))
    return [each for each in dict.fromkeys(found) if each.exists()]


def _hidden(path: Path) -> bool:
    """Returns whether an entry of a folder is left out. Entries that are left out are the lab itself, tests,
    and folders of packages; the entries of these folders are checked one by one."""
    name = path.name
    return name in (*LAB, "site-packages", "dist-packages") or name.startswith(("python", "tests"))


def confine(places: Sequence[Path]) -> tuple[str, ...]:
    """Removes this process's access to the network, to other processes and to files until the process ends.
    Reading in `places` remains allowed. Returns the names of the mechanisms of the operating system that
    enforce this."""
    calls = _calls()  # Landlock would prevent the search for seccomp's library
    steps = (("Landlock", partial(_files, places)), ("seccomp", calls))
    return tuple(name for name, step in steps if step())


def _files(places: Sequence[Path]) -> bool:
    """Forbids, by Landlock, reading outside `places`, all writing, signals to other processes and TCP.
    Returns whether this was possible."""
    try:
        from py_landlock import AccessFs, Landlock
    except ImportError:
        return False
    try:
        rules = Landlock(strict=False)
        for path in places:
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
    return partial(_without_calls, pyseccomp)


def _without_calls(sec: Any) -> bool:
    """Forbids, by seccomp, all calls that start, signal or read other processes, open sockets or change
    files. Returns whether this was possible."""
    no, unknown = sec.ERRNO(EPERM), sec.ERRNO(ENOSYS)
    thread = 0x10000  # CLONE_THREAD
    try:
        rules = sec.SyscallFilter(sec.ALLOW)
        for name in _SYSCALLS:
            with suppress(OSError, ValueError):  # not every processor has all of these calls
                rules.add_rule(no, name)
        rules.add_rule(no, "clone", sec.Arg(0, sec.MASKED_EQ, thread, 0))
        rules.add_rule(unknown, "clone3")  # a filter cannot read its flags; the C library then uses clone
        rules.add_rule(unknown, "openat2")
        rules.add_rule(no, "tgkill", sec.Arg(0, sec.NE, os.getpid()))
        rules.add_rule(no, "prlimit64", sec.Arg(0, sec.NE, 0))
        rules.add_rule(no, "prctl", sec.Arg(0, sec.EQ, _PARENT_DIES))
        for command in (8, 10, 15):  # F_SETOWN, F_SETSIG, F_SETOWN_EX: signals through a pipe
            rules.add_rule(no, "fcntl", sec.Arg(1, sec.EQ, command))
        for flag in (os.O_WRONLY, os.O_RDWR, os.O_CREAT):
            rules.add_rule(no, "openat", sec.Arg(2, sec.MASKED_EQ, flag, flag))
            with suppress(OSError, ValueError):
                rules.add_rule(no, "open", sec.Arg(1, sec.MASKED_EQ, flag, flag))
        rules.load()
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
    for name in [each for each in sys.modules if each.partition(".")[0] in LAB and each not in HANDED]:
        del sys.modules[name]
    sys.meta_path.insert(0, _Hidden())


def refuse(places: Sequence[Path], refused: RefusedCalls) -> None:
    """Makes Python refuse four actions in every thread: opening files that no import reads, starting
    programs, sending signals, and using the network. This is needed where the operating system does not
    refuse these actions. By itself it does not stop hostile code.

    Args:
        places: paths that imports may read.
        refused: list to which refused calls are added.
    """
    archives = (each for each in sys.path if not os.path.isdir(each))
    allowed = tuple(os.path.realpath(str(each)) for each in (*places, *archives))

    def hook(event: str, given: Sequence[Any]) -> None:
        if event == "open":
            path, mode, flags = given
            if isinstance(path, int):
                return
            writing = bool(set("wax+") & set(mode or "")) or bool((flags or 0) & _CHANGING)
            if not writing and os.path.realpath(os.fsdecode(path)).startswith(allowed):
                return
            if not writing and str(path).endswith(".py"):  # Python opens the file of an error to quote a line
                raise PermissionError(f"a submission may not read {path}")
        elif not event.startswith(_EVENTS):
            return
        what = " ".join((event, *(f"{each:.60}" for each in given[:1] if isinstance(each, str))))
        refused.append(what)
        raise PermissionError(f"a submission may not do that ({what})")

    sys.addaudithook(hook)
