"""Reads a user's file, executes it if it is Python, and reports an error in it as one sentence. `Folder` is
the folder with the files that may be named not only at the start of the program, but also later."""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from robots import InputError
from robots.errors import shortened

SUFFIX = ".py"
LESSON_SUFFIX = ".md"
LARGEST = 1_000_000  # bytes


def is_file(name: str) -> bool:
    """Returns whether a text given as a name is the path of a Python file."""
    return name.endswith(SUFFIX)


def is_lesson(name: str) -> bool:
    """Returns whether a text given as a name is the path of a file with a lesson."""
    return name.endswith(LESSON_SUFFIX)


Stamp = tuple[str, int, int]
"""Path, time and size of a file. If the stamp changes, the file was saved."""


def stamp(path: str) -> Stamp | None:
    """Returns the stamp of a file; None while there is no file, as for a moment while it is saved."""
    try:
        status = os.stat(path)
    except OSError:
        return None
    return path, status.st_mtime_ns, status.st_size


@dataclass(frozen=True)
class Source:
    """A file as it was read.

    Attributes:
        path: its path, as the user gave it.
        text: its content.
    """

    path: str
    text: str

    @property
    def digest(self) -> str:
        """SHA-256 of the content; equal digests mean equal content."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def module(self) -> str:
        """The name of the file's module in Python."""
        digest = hashlib.sha256(os.fsencode(Path(self.path).absolute())).hexdigest()[:12]
        return f"himpc_lab_own_{digest}"


def read(path: str) -> Source:
    """Reads a file. Raises InputError if it does not exist, is not a regular file, or is not text."""
    try:
        with open(path, "rb", opener=_at_once) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise OSError(0, "not a regular file")
            data = file.read(LARGEST + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else "no such path"
        raise InputError(
            f"{shortened(path, 200)}: cannot be read ({reason}); give the path of a file, or begin "
            "with himpc-lab new"
        ) from None
    if len(data) > LARGEST:
        raise InputError(f"{path}: has more than {LARGEST // 1_000_000} MB; give a shorter file")
    try:
        return Source(path, data.decode())
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise InputError(f"{path}, line {line}: is not text in UTF-8; save it as UTF-8") from None


def _at_once(path: str, flags: int) -> int:
    """Opens a file without waiting: a named pipe would wait for somebody who writes into it."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def fingerprint(path: str) -> str:
    """Returns the name of a file and the first characters of its digest, e.g. "mine.py@3fa9c1d20b7e". Raises
    InputError if it cannot be read."""
    return f"{Path(path).name}@{read(path).digest[:12]}"


def by_name(words: Iterable[str]) -> list[str]:
    """Returns choices with file names instead of full paths. A message about a code from another person must
    not reveal folders of this machine."""
    return [Path(word).name if is_file(word) else word for word in words]


def with_fingerprint(mark: str, files: Iterable[str], kind: str) -> str:
    """Returns the file, among several, that has a given fingerprint. kind: the kind of file, which is also
    the name of its option. Raises InputError if no file has this fingerprint."""
    name = mark.partition("@")[0]
    alike = [file for file in files if is_file(file) and Path(file).name == name]
    for file in alike:
        if fingerprint(file) == mark:
            return file
    if alike:
        raise InputError(
            f"{Path(alike[0]).name} differs from the {shortened(name, 60)} with which this was made: "
            f"its fingerprint is {fingerprint(alike[0])} instead of {shortened(mark, 100)}; get that file"
        )
    raise InputError(
        f"this was made with a user's file of a {kind}, {shortened(mark, 100)}: get that file and add "
        f"--{kind} {shortened(name, 60)}"
    )


def execute(source: Source) -> ModuleType:
    """Returns the module that the file defines. Raises InputError, with the line, if it cannot be
    executed."""
    module = ModuleType(source.module)
    module.__file__ = source.path
    sys.modules[source.module] = module
    try:
        with _beside(source.path):
            exec(compile(source.text, source.path, "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[source.module]
        raise InputError(sentence(source.path, error)) from None
    return module


@contextmanager
def _beside(path: str) -> Iterator[None]:
    """Lets a file import modules from its own folder, except those with the name of an installed module."""
    folder = str(Path(path).absolute().parent)
    sys.path.append(folder)
    try:
        yield
    finally:
        sys.path.remove(folder)


def _shown(error: SyntaxError) -> str:
    """Returns the wrong line with a caret below the place of the error, as two further lines; "" if they are
    not known."""
    line = (error.text or "").rstrip()
    if not line.strip() or not error.offset:
        return ""
    indent = len(line) - len(line.lstrip())
    column = max(error.offset - 1 - indent, 0)
    begin = max(column - _SHOWN // 2, 0)  # of a long line, the part around the place
    return f"\n  {line.strip()[begin:][:_SHOWN]}\n  {' ' * (column - begin)}^"


_SHOWN = 100


def sentence(path: str, error: BaseException) -> str:
    """Returns a sentence with the line of the file that raised an exception, and the exception's message."""
    if isinstance(error, SyntaxError) and error.filename == path:
        return f"{path}, line {error.lineno}: {error.msg}{_shown(error)}"
    steps = traceback.walk_tb(error.__traceback__)
    lines = [line for frame, line in steps if frame.f_code.co_filename == path]
    location = f"{path}, line {lines[-1]}" if lines else path
    if isinstance(error, SystemExit):
        return f"{location}: it ends the program (SystemExit): leave that out"
    if isinstance(error, MemoryError):
        return f"{location}: it needs more memory than is available"
    message = " ".join(str(error).split())
    if isinstance(error, InputError):
        return f"{location}: {shortened(message, 1000)}"
    return f"{location}: {type(error).__name__}: {shortened(message, 200)}"


@dataclass(frozen=True)
class Folder:
    """path: absolute, without symbolic links."""

    path: Path

    @classmethod
    def at(cls, name: str) -> Folder:
        """Returns the folder with this name. Raises InputError if it does not exist."""
        try:
            path = Path(os.path.realpath(name))
        except (OSError, ValueError):  # the folder "." was removed, or this is not a path
            path = None
        if path is None or not path.is_dir():
            raise InputError(f"--own-files {shortened(name, 100)} is not a folder: give one that exists")
        return cls(path)

    def holds(self, path: str) -> bool:
        """Returns whether a path is below the folder after all links and dots are resolved."""
        try:
            return self.path in Path(os.path.realpath(path)).parents
        except ValueError:  # e.g. a zero byte
            return False

    def admits(self, name: str) -> str:
        """Returns the path of a file below the folder, after all links and dots of its name are resolved. The
        path is relative if the file is below the folder in which the program was started.

        Raises:
            InputError: the path leads outside the folder. The message does not reveal whether there is such a
                file.
        """
        file = str(self.path / name)
        if not self.holds(file):
            raise InputError(
                f"{shortened(name, 100)}: the page opens only files below the folder in which himpc-lab was "
                "started, or below the folder of --own-files DIR"
            )
        path, here = Path(os.path.realpath(file)), Path(os.path.realpath(Path.cwd()))
        return str(path.relative_to(here) if path.is_relative_to(here) else path)
