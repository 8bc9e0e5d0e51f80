"""Finds the mesh files of a URDF: next to it, in ROS-style package folders, or in installed mesh packages."""

from __future__ import annotations

import os
import site
import sys
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path, PurePosixPath
from urllib.parse import unquote, urlparse

from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import listed, shortened
from robots.report import Finding

RENAMED = {"kuka_lbr_iiwa_support": "kuka_description/kuka_lbr_iiwa"}
"""In rtb-data, the folders of some packages have other names than the packages."""
IN_EXTRA = """a1_description abb_irb140_description alex_description alexander_description
allegro_hand_description anymal_b_simple_description anymal_c_simple_description asr_twodof_description
b1_description baxter_description bolt_description borinot_description cassie_description centauro_description
clearpath_ridgeback_description double_pendulum_description example-robot-data finger_edu_description
g1_description go1_description go2_description hector_description hextilt_description human_description
hyq_description icub_description iris_description kinova_description kuka_description kuka_lbr_iiwa_support
laikago_description lynxmotion_al5d_description panda_description pr2_description quadruped_description
qut_frankie_description romeo_description simple_humanoid_description so_arm_description solo_description
talos_data tiago_description tiago_pro_description trossen_descriptions unimation_puma560_description
ur_description xarm_description z1_description"""
"""The packages with meshes that the extra `meshes` installs."""

_PLACES = "the folder of the URDF and all folders above it, the ROS package path, and the installed packages"
_DEEPEST = 5  # largest number of folders and file that the end of a path may have
_STAND_INS = 20  # largest number of findings about folders that stood in


def localise(root: Element, folder: Path | None, within: Path | None = None) -> Iterator[Finding]:
    """Removes every shape whose mesh is not found, and yields a note. The link is then drawn as capsules.

    The name of a mesh in an installed package stays a `package://` name; all other names become absolute
    paths. within: folder that must contain all meshes that are not installed; None: they may be anywhere.
    """
    missing: dict[str, str] = {}
    stood_in: dict[tuple[Path, str], dict[str, None]] = {}
    for link in root.findall("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            mesh = shape.find("geometry/mesh")
            if mesh is None:
                continue
            uri = mesh.get("filename", "")
            if installed_mesh(uri) is not None:
                continue
            package = (_package_parts(uri) or ("",))[0]
            place, path = mesh_file(uri, folder, within)
            if path is not None:
                mesh.set("filename", str(path))
                if place is not None:
                    stood_in.setdefault((place, package), {})[uri] = None
                continue
            link.remove(shape)
            if shape.tag == "visual":
                missing[uri] = package
    for (place, package), uris in list(stood_in.items())[:_STAND_INS]:
        what = f"package '{shortened(package)}'" if package else f"path of {len(uris)} mesh file(s) "
        what += "" if package else f"({listed(uris, 3)})"
        yield Finding("note", "meshes", f"the folder '{shortened(place.name)}' stood in for the {what}")
    if missing:
        text = f"{len(missing)} mesh file(s) not found ({listed(missing)}); capsules are drawn instead"
        text += f"; looked for in {_PLACES}" if folder else "; a zip of the robot's folder brings them along"
        if not {*missing.values()}.isdisjoint(IN_EXTRA.split()):
            text += "; `pip install himpc-lab[meshes]` brings them"
        yield Finding("note", "meshes", text)


def mesh_file(uri: str, folder: Path | None, within: Path | None = None) -> tuple[Path | None, Path | None]:
    """Returns the folder that stood in for the one that a mesh's name means, if one did, and the file; None
    for what there is not. The arguments are those of `localise`."""
    if folder is None:
        return None, None
    places = chain([(None, find_mesh(uri, folder))], _stand_ins(uri, folder))
    allowed = (each for each in places if each[1] and (within is None or within in each[1].parents))
    return next(allowed, (None, None))


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


def _stand_ins(uri: str, folder: Path) -> Iterator[tuple[Path, Path | None]]:
    """Yields a folder and the file in it that may be meant by a URI whose package, or whose path on another
    machine, does not exist: the longest end of the path that exists in the parent folders, then the file's
    name beside the URDF and in a folder `meshes`."""
    path = PurePosixPath(unquote(uri.partition("://")[2] or uri.replace("\\", "/")))
    parts = [part for part in path.parts if part not in ("..", "/") and "\0" not in part][-_DEEPEST:]
    for first in range(len(parts) - 1):
        for place in (folder, *folder.parents):
            yield place, _existing(place.joinpath(*parts[first:]))
    for place in (folder, folder / "meshes", folder.parent / "meshes") if parts else ():
        yield place, _existing(place / parts[-1])


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
        yield share / RENAMED.get(package, package)


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
