"""Where the meshes of a URDF are: beside it, in ROS-style package folders, or in installed mesh packages."""

from __future__ import annotations

import os
import site
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path, PurePosixPath
from urllib.parse import unquote, urlparse

from lxml.etree import _Element as Element

from robots.report import Finding

# rtb-data keeps packages under other folder names than their `package://` name.
_RENAMED = {"kuka_lbr_iiwa_support": "kuka_description/kuka_lbr_iiwa"}


def absolutise(root: Element, folder: Path | None) -> Iterator[Finding]:
    """Rewrites every mesh path of a URDF tree as an absolute one; yields a note per mesh not found.

    A mesh that is not found is removed together with its visual: the link is then drawn as capsules.
    """
    missing: dict[str, int] = {}
    for link in root.findall("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            mesh = shape.find("geometry/mesh")
            if mesh is None:
                continue
            uri = mesh.get("filename", "")
            path = find_mesh(uri, folder)
            if path is not None:
                mesh.set("filename", str(path))
                continue
            link.remove(shape)
            if shape.tag == "visual":
                missing[uri] = missing.get(uri, 0) + 1
    if missing:
        names = ", ".join(f"'{uri}'" for uri in list(missing)[:3]) + (", …" if len(missing) > 3 else "")
        text = f"{len(missing)} mesh file(s) not found ({names}); capsules are drawn instead"
        yield Finding("note", "meshes", f"{text}. `pip install himpc-lab[meshes]` brings many robots' meshes")


def find_mesh(uri: str, folder: Path | None) -> Path | None:
    """The file a mesh URI of a URDF names, or None.

    Plain paths and `file://` count from `folder`. `package://pkg/rest` is looked up in the ancestors of
    `folder`, the ROS package path and the installed packages; nothing is ever fetched.
    """
    if not uri.strip() or "\0" in uri:
        return None
    if "://" not in uri:
        return _existing(Path(uri) if folder is None else folder / uri)
    parsed = urlparse(uri)
    if parsed.scheme == "file":
        return _existing(Path(unquote(parsed.path)))
    if parsed.scheme not in ("package", "model"):
        return None
    package, rest = parsed.netloc, parsed.path.lstrip("/")
    if not package or ".." in PurePosixPath(rest).parts:
        return None
    return next(filter(None, (_existing(place / rest) for place in _package_folders(package, folder))), None)


def _package_folders(package: str, folder: Path | None) -> Iterator[Path]:
    if folder is not None:
        for ancestor in (folder, *folder.parents):
            if ancestor.name == package:
                yield ancestor
            yield ancestor / package
    for entry in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry) if Path(entry).name == package else Path(entry) / package
    for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry) / "share" / package
    for share in installed_shares():
        yield share / package
        yield share / _RENAMED.get(package, package)


@cache
def installed_shares() -> tuple[Path, ...]:
    """Folders of the installed mesh packages (example-robot-data, rtb-data) that hold robot packages."""
    places = [Path(entry) for entry in (*site.getsitepackages(), *sys.path) if entry]
    found: dict[Path, None] = {}
    for place in places:
        share = place / "cmeel.prefix" / "share"
        for candidate in (share, share / "example-robot-data" / "robots", place / "rtbdata" / "xacro"):
            if candidate.is_dir():
                found[candidate] = None
    return tuple(found)


def _existing(path: Path) -> Path | None:
    try:
        return path.resolve() if path.is_file() else None
    except (OSError, ValueError):
        return None
