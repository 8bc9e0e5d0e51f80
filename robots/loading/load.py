"""`load_robot` returns a robot by its catalog name or from a URDF file. Files from other sources are read in
a separate process."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from robots.catalog import CATALOG, CatalogEntry
from robots.errors import InputError, shortened, unknown_name
from robots.geometry.collision_model import CollisionModel
from robots.geometry.cover import Cover
from robots.geometry.files import stored
from robots.loading.imported import with_cover, with_geometry
from robots.loading.importing import Import, bounds, import_robot
from robots.meshes.files import has_meshes
from robots.processes.isolation import Fault, isolated
from robots.report import Finding, ImportReport
from robots.robot import Robot
from robots.urdf import canonicalise, load_bytes

_SHORT = 200_000  # bytes; the robots of the last four files up to this size stay in memory


def load_robot(
    name_or_path: str | Path,
    tip: str | None = None,
    within: Path | None = None,
    hold: tuple[str, ...] = (),
) -> Robot:
    """Returns the robot with this catalog name, or the robot that a URDF file describes.

    tip: the default end-effector frame; None: the tip of the catalog, or the end of the longest chain.
    within: a folder, given without symbolic links. It must contain the URDF file and its meshes, except
    installed meshes. None: files may be anywhere.
    hold: joints that are not controlled, "REGEX" or "REGEX=VALUE" with the whole name of a joint or a regular
    expression for it, and the value at which it is held, rad or m (0 without it, and always inside its
    limits). Home, M̄ and shapes of a robot of the catalog with held joints are estimated as for a file.

    Raises InputError for an unknown name, a missing file, a description that cannot be used, an unknown tip,
    or a pattern that fits no joint. The message is one sentence that tells the user what to do.
    """
    text = str(name_or_path)
    if text in CATALOG and hold:
        return import_file(CATALOG[text].path, tip or CATALOG[text].tip, hold=hold).used()
    if text in CATALOG:
        robot = _catalog_robot(CATALOG[text])
        return robot if tip is None else robot.with_tip(tip)
    path = Path(text)
    if "/" not in text and not path.suffix and not _exists(path):
        raise unknown_name("robot in the catalog called", text, CATALOG, "or give the path of a URDF file")
    if within is not None and not path.resolve().is_relative_to(within):
        raise InputError(f"The URDF '{shortened(text, 100)}' is not in the folder whose files may be opened.")
    return import_file(path, tip, within, hold).used()


def load_urdf_text(text: str, tip: str | None = None, hold: tuple[str, ...] = ()) -> Robot:
    """Returns the robot that a URDF string describes: an upload, or a stored canonical text.

    The description can use the meshes of installed packages, by `package://`, and no other files.

    Raises InputError like `load_robot`.
    """
    return _import(text.encode(errors="replace"), "the URDF text", None, tip, None, hold).used()


def check_urdf(path: str | Path, hold: tuple[str, ...] = ()) -> ImportReport:
    """Returns the import report of a URDF file: everything that the import repairs, adds, fixes or refuses.

    Invalid content raises no exception; InputError is raised if there is no such file, or if a pattern in
    `hold` fits no joint.
    """
    return import_file(Path(path), None, hold=hold).report


def import_file(
    path: Path, tip: str | None = None, within: Path | None = None, hold: tuple[str, ...] = ()
) -> Import:
    """Returns the robot of a URDF file, or None for one that cannot be used, with the report of its import.
    The arguments and the exceptions are those of `load_robot` and `check_urdf`."""
    return _import(load_bytes(path), shortened(str(path), 100), path.resolve().parent, tip, within, hold)


def _import(
    data: bytes,
    source: str,
    folder: Path | None,
    tip: str | None,
    within: Path | None,
    hold: tuple[str, ...],
) -> Import:
    # A file without meshes always results in the same robot. The process that reads it uses a core for 1.8 s.
    keeps = folder is not None and len(data) < _SHORT and b"mesh" not in data
    try:
        found = (_kept if keeps else _read_apart)(data, source, folder, tip, within, hold)
    except Fault as fault:
        return Import(ImportReport(source, (Finding("refused", source, str(fault)),)))
    if found.robot is None or not has_meshes(found.robot.urdf_text):
        return found
    try:
        robot = isolated(with_geometry, found.robot)
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


def _catalog_robot(entry: CatalogEntry) -> Robot:
    canonical, report = canonicalise(load_bytes(entry.path), f"robots/{entry.name}", entry.path.parent)
    assert canonical is not None, report.findings
    model = canonical.model
    lower, upper = bounds(model)
    return Robot(
        name=entry.name,
        model=model,
        joint_names=tuple(model.names)[1:],
        tip=entry.tip,
        home=entry.home,
        q_lower=lower,
        q_upper=upper,
        v_limit=model.velocityLimit,
        tau_limit=model.effortLimit,
        a_max=np.array(entry.a_max),
        M_bar=np.array(entry.M_bar),
        urdf_text=canonical.text,
        report=replace(report, tip=entry.tip),
        collision=stored(CollisionModel, entry.collision_path),
        cover=stored(Cover, entry.cover_path),
    )


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:
        return False
