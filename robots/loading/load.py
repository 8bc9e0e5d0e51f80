"""`load_robot` returns a robot by its catalog name or from a description: a file, a folder or a zip. Files
from other sources are read in a separate process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from robots.catalog import CATALOG
from robots.errors import InputError, shortened, unknown_name
from robots.loading.archive import MAX_PACKED, description, unpack
from robots.loading.catalog_robot import catalog_robot
from robots.loading.imported import with_cover, with_geometry
from robots.loading.importing import Import, import_robot
from robots.meshes.files import has_meshes
from robots.processes.isolation import Allowance, Fault, isolated
from robots.report import Finding, ImportReport
from robots.robot import Robot
from robots.urdf import load_bytes

_SHORT = 200_000  # bytes; the robots of the last four files up to this size stay in memory
_ZIP = b"PK"  # the first bytes of a zip
_GEOMETRY = Allowance(24.0)
"""For the meshes of a robot, their hulls and capsules. At most 8 s are for reading (`READING`)."""


def load_robot(
    name_or_path: str | Path,
    tip: str | None = None,
    within: Path | None = None,
    hold: tuple[str, ...] = (),
) -> Robot:
    """Returns the robot with this catalog name, or the robot of a description.

    name_or_path: also a URDF file, a folder or a zip with one, or the path of a URDF inside a zip.
    tip: the default end-effector frame; None: the tip of the catalog, or the end of the longest chain.
    "FRAME@x,y,z,roll,pitch,yaw" is a tool at this place (m, rad) on a frame, "@x,y,z" one on the default tip.
    within: a folder, given without symbolic links. It must contain the URDF file and its meshes, except
    installed meshes. None: files may be anywhere.
    hold: joints that are not controlled, "REGEX" or "REGEX=VALUE" with the whole name of a joint or a regular
    expression for it, and the value at which it is held, rad or m, inside its limits; without a value it is
    held where the home of the file or of the catalog has it, or at 0.

    Raises InputError for an unknown name, a missing file, a description that cannot be used, an unknown tip,
    or a pattern that fits no joint. The message is one sentence that tells the user what to do.
    """
    text = str(name_or_path)
    if text in CATALOG:
        return catalog_robot(CATALOG[text], tip, hold)
    path = Path(text)
    if "/" not in text and not path.suffix and not _exists(path):
        raise unknown_name("robot in the catalog called", text, CATALOG, "or give the path of a URDF file")
    return import_file(path, tip, within, hold).used()


def load_urdf_text(text: str | bytes, tip: str | None = None, hold: tuple[str, ...] = ()) -> Robot:
    """Returns the robot that a URDF describes: an upload, or a stored canonical text. Bytes may also be a zip
    with the robot's folder.

    The description can use the meshes in the zip, those of installed packages, by `package://`, and no other
    files.

    Raises InputError like `load_robot`.
    """
    data = text.encode(errors="replace") if isinstance(text, str) else text
    if data.startswith(_ZIP):
        return _import_zip(data, "the zip", lambda _: "leave only one of them in the zip", tip, hold).used()
    return _import(data, "the URDF text", None, tip, None, hold).used()


def check_urdf(path: str | Path, hold: tuple[str, ...] = ()) -> ImportReport:
    """Returns the import report of a description, as `load_robot` finds it: everything that the import
    repairs, adds, fixes or refuses.

    Invalid content raises no exception; InputError is raised if there is no such file, or if a pattern in
    `hold` fits no joint.
    """
    return import_file(Path(path), hold=hold).report


def import_file(
    path: Path, tip: str | None = None, within: Path | None = None, hold: tuple[str, ...] = ()
) -> Import:
    """Returns the robot of a file, a folder or a zip, or None for one that cannot be used, with the report of
    its import. The arguments and the exceptions are those of `load_robot` and `check_urdf`."""
    source = shortened(str(path), 100)
    packed = _zip_of(path)
    if not _exists(path) and (packed is None or not _exists(packed)):
        load_bytes(path)  # it says why there is no such file
    _check_inside(path, within)

    def choose(name: str) -> str:
        return f"choose one, such as {path}/{name}"

    if packed is not None and packed.is_file():
        inside = path.relative_to(packed)
        return _import_zip(load_bytes(packed, MAX_PACKED), str(packed), choose, tip, hold, inside)
    if path.is_dir():
        path = description(path, source, choose)
        source = shortened(str(path), 100)
        _check_inside(path, within)
    return _import(load_bytes(path), source, path.resolve().parent, tip, within, hold)


def _zip_of(path: Path) -> Path | None:
    """Returns the innermost zip that the path names or lies in. The time is proportional to the path's
    length, unlike that of `path.parents`."""
    parts = path.parts
    ends = (k for k in range(len(parts), 0, -1) if parts[k - 1].lower().endswith(".zip"))
    end = next(ends, None)
    return None if end is None else Path(*parts[:end])


def _check_inside(path: Path, within: Path | None, name: str = "") -> None:
    if within is not None and not path.resolve().is_relative_to(within):
        name = shortened(name or str(path), 100)
        raise InputError(f"The URDF '{name}' is not in the folder whose files may be opened.")


def _import_zip(
    data: bytes,
    source: str,
    choose: Callable[[str], str],
    tip: str | None,
    hold: tuple[str, ...],
    inside: Path = Path(),
) -> Import:
    """Imports the robot of a zip. The unpacked files are deleted afterwards, so the robot keeps its
    surfaces.

    choose: see `description`. inside: the path of the description in the zip, if it is known.
    """
    with TemporaryDirectory(prefix="himpc-lab-", ignore_cleanup_errors=True) as temporary:  # mode 0700
        folder = Path(temporary).resolve()
        try:
            isolated(unpack, data, folder)
        except Fault as fault:
            return Import(ImportReport(source, (Finding("refused", source, str(fault)),)))
        path = description(folder, source, choose) if inside == Path() else folder / inside
        where = f"{source}/{path.relative_to(folder)}"
        _check_inside(path, folder, where)
        data, name = load_bytes(path, name=where), shortened(where, 100)
        found = _import(data, name, path.parent, tip, folder, hold)
        if found.robot is None:
            return found
        robot = _with_surfaces(found.robot)
        return Import(found.report, replace(robot, urdf_text=robot.urdf_text.replace(f"{folder}/", "")))


def _with_surfaces(robot: Robot) -> Robot:
    from robots.shapes.link_shapes import link_shapes  # it loads trimesh

    return replace(robot, surfaces=tuple(link_shapes(robot)))


def _import(
    data: bytes,
    source: str,
    folder: Path | None,
    tip: str | None,
    within: Path | None,
    hold: tuple[str, ...],
) -> Import:
    # A file that names no other always results in the same robot. The process that reads it uses a core for
    # 1.8 s.
    alone = b"mesh" not in data and b"include" not in data
    keeps = folder is not None and len(data) < _SHORT and alone
    try:
        found = (_kept if keeps else _read_apart)(data, source, folder, tip, within, hold)
    except Fault as fault:
        return Import(ImportReport(source, (Finding("refused", source, str(fault)),)))
    if found.robot is None or not has_meshes(found.robot.urdf_text):
        return found
    try:
        robot = isolated(with_geometry, found.robot, within=_GEOMETRY)
    except Fault:
        robot = with_geometry(found.robot, meshes=False)
    return Import(robot.report, robot)


def _read_apart(*document: object) -> Import:
    return isolated(_imported, *document)


_kept = lru_cache(maxsize=4)(_read_apart)


def _imported(*document: Any) -> Import:
    found = import_robot(*document)
    if found.robot is None or has_meshes(found.robot.urdf_text):
        return found
    robot = with_cover(found.robot)
    return Import(robot.report, robot)


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that is too long, or that no file can have
        return False
