"""Unpacks a zip with a robot's folder within limits, and finds the description in a folder."""

from __future__ import annotations

import os
import stat
import zipfile
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path, PurePosixPath

from robots.errors import InputError, listed, shortened
from robots.urdf.read import root_tag

MAX_PACKED = 200_000_000  # bytes of a zip on this machine; the page accepts less
MAX_UNPACKED = 300_000_000  # bytes
MAX_ENTRIES = 5_000
_MAX_FILES = 20_000  # files and folders in which a description is looked for
_KEPT = {".urdf", ".xml", ".stl", ".dae", ".obj", ".mtl", ".ply", ".glb", ".gltf", ".bin", ".off", ".msh"}
"""Only such files are unpacked: descriptions, and what their meshes consist of. An archive in the zip stays
closed."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_CHUNK = 1 << 20


def unpack(data: bytes, folder: Path) -> None:
    """Writes the descriptions and meshes in a zip below a new folder. Links are left out. Nothing is
    executed.

    Raises InputError for a zip that is damaged, encrypted, too large, has too many entries, or names a file
    outside the folder.
    """
    if len(data) > MAX_PACKED:
        raise InputError(f"The zip has more than {MAX_PACKED // 1_000_000} MB: leave out what is not needed.")
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            _unpack(archive, folder)
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"The zip cannot be read ({shortened(str(error), 80)}): make a new one, without a password."
        ) from None


def _unpack(archive: zipfile.ZipFile, folder: Path) -> None:
    entries = archive.infolist()
    if len(entries) > MAX_ENTRIES:
        raise InputError(
            f"The zip has {len(entries)} entries; at most {MAX_ENTRIES} are unpacked: leave out what the "
            "robot does not need."
        )
    left = MAX_UNPACKED
    for entry in entries:
        name = PurePosixPath(entry.filename.replace("\\", "/"))
        if name.is_absolute() or ".." in name.parts or ":" in entry.filename or "\0" in entry.filename:
            raise InputError(
                f"The zip has the entry '{shortened(entry.filename)}', which leads out of its folder: make "
                "a new one."
            )
        mode = entry.external_attr >> 16
        hidden = any(part.startswith((".", "__MACOSX")) for part in name.parts)
        if entry.is_dir() or hidden or name.suffix.lower() not in _KEPT or stat.S_ISLNK(mode):
            continue
        if entry.compress_type not in _METHODS:
            raise InputError(
                f"The zip's '{shortened(entry.filename)}' is not compressed by deflate: make a usual zip."
            )
        left = _write(archive, entry, folder / name, left)


def _write(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path, left: int) -> int:
    """Unpacks one file and returns the number of bytes that may still be written. What an entry says about
    its size is not believed."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        out = path.open("xb")
    except OSError:  # the name is too long, or is used twice
        return left
    with archive.open(entry) as packed, out:
        while part := packed.read(_CHUNK):
            left -= len(part)
            if left < 0:
                raise InputError(
                    f"The zip unpacks to more than {MAX_UNPACKED // 1_000_000} MB: leave out what the robot "
                    "does not need."
                )
            out.write(part)
    return left


def description(folder: Path, source: str, choose: Callable[[str], str]) -> Path:
    """Returns the robot description in or below a folder: the only one, or the only one with the folder's
    name. choose: returns how the user chooses one of several, such as the one with this path in the folder.

    Raises InputError if there is none or if there are several.
    """
    found = list(_descriptions(folder, source))
    named = [path for path in found if path.stem == Path(source).stem]
    if len(found) == 1 or len(named) == 1:
        return (named or found)[0]
    if not found:
        raise InputError(
            f"{source} has no robot description, a file .urdf or a MuJoCo model .xml: add one; `xacro FILE > "
            "robot.urdf` makes one from a template."
        )
    names = [path.relative_to(folder).as_posix() for path in found]
    raise InputError(
        f"{source} has {len(found)} robot descriptions ({listed(names, 10)}): {choose(names[0])}."
    )


def _descriptions(folder: Path, source: str) -> Iterator[Path]:
    seen = 0
    for place, folders, files in os.walk(folder):
        folders.sort()
        seen += len(folders) + len(files)
        if seen > _MAX_FILES:
            raise InputError(f"{source} has more than {_MAX_FILES} files: give the path of the description.")
        for name in sorted(files):
            if is_description(Path(place, name)):
                yield Path(place, name)


def is_description(path: Path) -> bool:
    """Returns whether a file is a URDF by its name, or a URDF or MuJoCo model by its root element."""
    kind = path.suffix.lower()
    return kind == ".urdf" or (kind == ".xml" and root_tag(_beginning(path)) in ("robot", "mujoco"))


def _beginning(path: Path) -> bytes:
    try:
        if not path.is_file():  # opening a named pipe would wait
            return b""
        with path.open("rb") as file:
            return file.read(_CHUNK)
    except OSError:
        return b""
