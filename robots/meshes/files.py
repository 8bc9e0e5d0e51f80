"""Finds the mesh files of a URDF: next to it, in ROS-style package folders, or in installed mesh packages."""

from __future__ import annotations

import os
import site
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path, PurePosixPath
from urllib.parse import unquote, urlparse

from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import shortened
from robots.report import Finding

# In rtb-data, the folders of some packages have other names than the packages.
_RENAMED = {"kuka_lbr_iiwa_support": "kuka_description/kuka_lbr_iiwa"}


def localise(root: Element, folder: Path | None, within: Path | None = None) -> Iterator[Finding]:
    """Removes every shape whose mesh is not found, and yields a note. The link is then drawn as capsules.

    The name of a mesh in an installed package stays a `package://` name; all other names become absolute
    paths. within: folder that must contain all meshes that are not installed; None: they may be anywhere.
    """
    missing: dict[str, int] = {}
    for link in root.findall("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            mesh = shape.find("geometry/mesh")
            if mesh is None:
                continue
            uri = mesh.get("filename", "")
            if installed_mesh(uri) is not None:
                continue
            path = None if folder is None else find_mesh(uri, folder)
            if path is not None and (within is None or path.is_relative_to(within)):
                mesh.set("filename", str(path))
                continue
            link.remove(shape)
            if shape.tag == "visual":
                missing[uri] = missing.get(uri, 0) + 1
    if missing:
        names = ", ".join(f"'{shortened(uri)}'" for uri in list(missing)[:3])
        more = ", …" if len(missing) > 3 else ""
        text = f"{len(missing)} mesh file(s) not found ({names}{more}); capsules are drawn instead"
        yield Finding("note", "meshes", f"{text}. `pip install himpc-lab[meshes]` brings many robots' meshes")


def has_meshes(text: str) -> bool:
    """Returns whether a canonical URDF names mesh files; it takes time to read them."""
    return next(etree.fromstring(text.encode()).iterfind("link/*/geometry/mesh"), None) is not None


def installed_mesh(uri: str) -> Path | None:
    """Returns the file of an installed package that a `package://` URI names, or None. Uploaded descriptions
    can use only these files."""
    parts = _package_parts(uri)
    if parts is None:
        return None
    return next(filter(None, (_existing(place / parts[1]) for place in _installed(parts[0]))), None)


def find_mesh(uri: str, folder: Path) -> Path | None:
    """Returns the file that a mesh URI names in a local URDF file, or None.

    Plain paths and `file://` paths are relative to `folder`. A `package://pkg/rest` URI is searched for in
    the parent folders of `folder`, in the ROS package path and in the installed packages. Nothing is
    downloaded.
    """
    if not uri.strip() or "\0" in uri:
        return None
    if "://" not in uri:
        return _existing(folder / uri)
    if uri.startswith("file://"):
        return _existing(Path(unquote(urlparse(uri).path)))
    parts = _package_parts(uri)
    if parts is None:
        return None
    places = _package_folders(parts[0], folder)
    return next(filter(None, (_existing(place / parts[1]) for place in places)), None)


def _package_parts(uri: str) -> tuple[str, str] | None:
    """Returns the package and the path inside the package for a `package://` URI whose path stays inside;
    None for any other URI."""
    scheme, separator, rest = uri.partition("://")
    package, _, path = rest.partition("/")
    if scheme not in ("package", "model") or not separator or "\0" in rest or "\\" in rest:
        return None
    if not package or not path.strip("/") or ".." in (package, *PurePosixPath(path).parts) or package == ".":
        return None
    return package, path.lstrip("/")


def _package_folders(package: str, folder: Path) -> Iterator[Path]:
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
    yield from _installed(package)


def _installed(package: str) -> Iterator[Path]:
    for share in installed_shares():
        yield share / package
        yield share / _RENAMED.get(package, package)


@cache
def installed_shares() -> tuple[Path, ...]:
    """Returns the folders with robot packages in the installed mesh packages (example-robot-data,
    rtb-data)."""
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
