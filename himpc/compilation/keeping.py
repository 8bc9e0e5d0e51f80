"""Stores compiled functions on disk: one file each, in a folder to which no other user can write.

Numba's own cache trusts every file in its folder. A truncated or damaged file stops every start of the
program, a file of another user is executed, and a full disk stops the program. This cache writes a digest of
the content, of the sources and of the target at the beginning of each file. If a file is incomplete, belongs
to another user or was made from other sources, the function is compiled again and the file is replaced. Code
that cannot be written to disk is used from memory.
"""

from __future__ import annotations

import os
import pickle
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any
from uuid import uuid4

import numba
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

_POSIX = os.name == "posix"
_PLAIN = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
"""Flags for opening a file: symbolic links are not followed, and line ends are not converted."""
_ROOM = 8 << 20
"""Free disk space that is required before code is written, in bytes: more than the size of all compiled
code."""
_FOLDER = "NUMBA_CACHE_DIR"
"""Name of an environment variable; its value is the folder to use instead of the default ones."""


class Kept:
    """The cache interface that Numba uses for one function; several folders are tried in order.

    Args:
        source: the file that contains the function.
        name: the function's name.
        digest: digest of all source files that the function's code depends on.
    """

    def __init__(self, source: Path, name: str, digest: bytes) -> None:
        self._source, self._name, self._digest = source.resolve(), name, digest

    @property
    def cache_path(self) -> str | None:
        """The folder to which code is written; None if no folder is usable."""
        return next((str(folder) for folder in self._folders(make=True)), None)

    def has_room(self) -> bool:
        """Returns whether a folder has enough free disk space for the code."""
        return any(_written(folder / "room", bytes(_ROOM), keep=False) for folder in self._folders(make=True))

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Returns the compiled function for these types. Returns None if there is no such file that is
        complete, current and owned by this user."""
        name, made_for = self._file(signature, context.codegen())
        for folder in self._folders(make=False):
            body = _read(folder / name)
            if body is not None and body.startswith(made_for):
                with suppress(Exception):  # loading a file of another build may raise any exception
                    return CompileResult._rebuild(context, *pickle.loads(body[len(made_for) :]))
        return None

    def save_overload(self, signature: Any, result: Any) -> None:
        """Writes a compiled function to the first folder that accepts it, if any does."""
        if result.library.has_dynamic_globals or any(not loop.can_cache for loop in result.lifted):
            return
        name, made_for = self._file(signature, result.codegen)
        body = made_for + dumps(result._reduce())
        for folder in self._folders(make=True):
            if _written(folder / name, sha256(body).digest() + body):
                return

    def load_bytes(self, key: str) -> bytes | None:
        """Returns the bytes that `save_bytes` wrote with this key for the same sources; None without such a
        file."""
        name, made_for = self._named(key)
        for folder in self._folders(make=False):
            body = _read(folder / name)
            if body is not None and body.startswith(made_for):
                return body[len(made_for) :]
        return None

    def save_bytes(self, key: str, content: bytes) -> None:
        """Writes bytes that depend on the function's sources to the first folder that accepts them, if any
        does."""
        name, made_for = self._named(key)
        body = made_for + content
        for folder in self._folders(make=True):
            if _written(folder / name, sha256(body).digest() + body):
                return

    def _named(self, key: str) -> tuple[str, bytes]:
        """Returns the name of the file for a key, and the first bytes of the file after its digest."""
        version = f"{numba.__version__} {sys.version}".encode()
        return f"{self._source.stem}.{self._name}-{key}.code", sha256(self._digest + version).digest()

    def enable(self) -> None:
        """Does nothing: the cache is always enabled."""

    def disable(self) -> None:
        """Does nothing: Numba's interface has this method, and this package never calls it."""

    def flush(self) -> None:
        """Does nothing: files are written at once."""

    def _file(self, signature: Any, codegen: Any) -> tuple[str, bytes]:
        """Returns the name of the file with the code for these types and this processor, and the first bytes
        of the file after its digest."""
        target = repr((signature, codegen.magic_tuple())).encode()
        version = f"{numba.__version__} {sys.version}".encode()
        made_for = sha256(b"\0".join((self._digest, target, version))).digest()
        return f"{self._source.stem}.{self._name}-{sha256(target + version).hexdigest()[:16]}.code", made_for

    def _folders(self, make: bool) -> Iterator[Path]:
        """Yields the possible folders of the file, in the order in which they are tried. Only this user can
        write to them. The first is the folder in the environment variable; without this variable, a folder
        beside the source is the first and the user's cache the second. The last is a temporary folder."""
        own = f"{self._source.parent.name}-{sha256(bytes(self._source.parent)).hexdigest()[:16]}"
        named = os.environ.get(_FOLDER)
        if named:
            chains = [(Path(named, f"himpc-lab-{own}"),)]
        else:
            user = _users_cache() / "himpc-lab"
            chains = [(self._source.parent / "__pycache__" / "compiled",), (user, user / own)]
        shared = Path(tempfile.gettempdir(), f"himpc-lab-compiled-{os.getuid() if _POSIX else 'user'}")
        none = True
        for chain in (*chains, (shared, shared / own)):
            if make:
                _make(chain[-1], above=chain[0] != shared)
            if all(map(_ours, chain)) and (not make or os.access(chain[-1], os.W_OK)):
                none = False
                yield chain[-1]
        if make and none and not named:
            with suppress(OSError):
                # Child processes inherit this variable and find the code in the same folder.
                os.environ[_FOLDER] = tempfile.mkdtemp(prefix="himpc-lab-compiled-")
                yield from self._folders(make)


def _users_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or "~\\AppData\\Local").expanduser()
    if sys.platform == "darwin":
        return Path("~/Library/Caches").expanduser()
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser()


def _make(folder: Path, above: bool) -> None:
    """Creates a folder for this user alone, if possible. With `above`, all missing parents are created
    too."""
    missing = [path for path in (folder, *folder.parents) if not os.path.lexists(path)]
    with suppress(OSError):
        for path in reversed(missing if above else missing[:2]):
            path.mkdir(mode=0o700)


def _ours(folder: Path) -> bool:
    """Returns whether a folder exists, belongs to this user and cannot be written to by anybody else."""
    try:
        status = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(status.st_mode) and _safe(status)


def _safe(status: os.stat_result) -> bool:
    return not _POSIX or (status.st_uid == os.getuid() and not status.st_mode & 0o022)


def _read(file: Path) -> bytes | None:
    """Returns the content of a file after its digest; None if the file is missing, incomplete or belongs to
    another user."""
    try:
        with open(os.open(file, os.O_RDONLY | _PLAIN), "rb") as stream:
            status = os.fstat(stream.fileno())
            data = stream.read() if stat.S_ISREG(status.st_mode) and _safe(status) else b""
    except OSError:
        return None
    digest, body = data[:32], data[32:]
    return body if sha256(body).digest() == digest else None


def _written(file: Path, data: bytes, keep: bool = True) -> bool:
    """Writes a file completely or not at all, and returns whether it was written. Other users can neither
    read nor write the file."""
    part = file.with_name(f".{file.name}.{uuid4().hex}")
    try:
        with open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _PLAIN, 0o600), "wb") as stream:
            stream.write(data)
        if keep:
            os.replace(part, file)
        return True
    except OSError:
        return False
    finally:
        with suppress(OSError):
            os.unlink(part)
