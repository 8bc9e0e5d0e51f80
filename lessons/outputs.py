"""Output files are written completely or not at all: a disk that is full leaves the old file as it was."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from uuid import uuid4


def write_files(files: Mapping[Path | str, bytes | str]) -> None:
    """Writes every file beside its old version and then replaces all old versions. Text is written as UTF-8.
    A device or a pipe is written directly, and a link still refers to its file.

    Raises:
        OSError: a file cannot be written; no old file is damaged.
    """
    parts: list[tuple[Path, Path]] = []
    direct: list[tuple[Path, bytes]] = []
    try:
        for target, content in files.items():
            path, data = check_target(target), content.encode() if isinstance(content, str) else content
            if path.exists() and not path.is_file():
                direct.append((path, data))
                continue
            parts.append((path.with_name(f".{uuid4().hex}.part"), path))
            _write(parts[-1][0], data)
            if path.exists():
                parts[-1][0].chmod(path.stat().st_mode & 0o777)
        for path, data in direct:
            with path.open("wb") as file:
                file.write(data)
        for part, path in parts:
            os.replace(part, path)
    finally:
        for part, _ in parts:
            with suppress(OSError):
                part.unlink()


def check_target(target: Path | str) -> Path:
    """Returns the path of the file that a name refers to. Raises OSError if the name is that of a folder, if
    its folder does not exist, or if the old file may not be changed."""
    path = Path(os.path.realpath(target))
    if path.is_dir() or os.fspath(target).endswith(os.sep):
        raise OSError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
    if not path.parent.is_dir():
        raise OSError(errno.ENOENT, os.strerror(errno.ENOENT), str(target))
    if path.exists() and not os.access(path, os.W_OK):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), str(target))
    return path


def _write(path: Path, data: bytes) -> None:
    with path.open("xb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
