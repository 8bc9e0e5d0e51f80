"""Reads a MuJoCo model (MJCF) with MuJoCo's own compiler. Of the document, only what describes the robot is
given to the compiler, and only files that the import may read."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import mujoco
from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import listed, shortened
from robots.meshes.files import mesh_file
from robots.report import Finding
from robots.urdf.read import MAX_BYTES, Refusal, load_bytes, read_xml

_INCLUDES = 100
_LARGE = 50.0
"""MB of mesh files. MuJoCo needs about fifteen times as much memory to compile them."""
_TURNS = 4.0 * math.pi  # rad
_RADIANS = (
    'its ranges look like radians, and no <compiler> says so: MuJoCo would read degrees; add angle="radian"'
)
_MESHES = 200_000_000  # bytes
_UNUSED = (
    *("texture", "layer", "hfield", "skin", "visual", "statistic", "size", "contact", "sensor", "keyframe"),
    *("custom", "extension", "plugin", "deformable", "flexcomp", "composite"),
)
"""Elements that say nothing about a robot's motion, or cannot be part of a chain of links. Some of them read
files."""


@dataclass(frozen=True)
class Compiled:
    """A compiled model, the files of its meshes by their names, the name and the text of `qpos` of each key
    posture, and what was noted."""

    name: str
    model: mujoco.MjModel
    meshes: dict[str, Path]
    keys: tuple[tuple[str, str], ...]
    findings: tuple[Finding, ...]


def compiled_mjcf(
    data: bytes, source: str, folder: Path | None = None, within: Path | None = None
) -> Compiled:
    """Returns the compiled model of an MJCF document. MuJoCo opens no file: meshes and included files are
    looked for like the meshes of a URDF. The arguments are those of `canonicalise`.

    Raises Refusal for a model that cannot be read or compiled.
    """
    findings: list[Finding] = []
    root = _parsed(data, source, findings)
    _include(root, source, folder, within, findings)
    if next(root.iter("attach", "model"), None) is not None:
        raise Refusal(source, "it attaches other models; give the whole model (MuJoCo's `MjSpec.to_xml`)")
    keys = tuple((key.get("name", ""), key.get("qpos", "")) for key in root.iterfind("keyframe/key"))
    for tag in _UNUSED:
        for element in [*root.iter(tag)]:
            _remove(element)
    for element in root.iter():
        element.attrib.pop("texture", None)
    files, meshes, missing = _meshes(root, folder, within)
    for geom in [*root.iter("geom")]:
        if geom.get("hfield") is not None or geom.get("mesh") in missing:
            _remove(geom)
    turns = _in_radians(root)
    if turns:
        etree.SubElement(root, "compiler", angle="radian")
    # A body that had its mass from a mesh that is missing gets the mass that the import of a URDF gives it.
    least = {"boundmass": "1e-9", "boundinertia": "1e-14"} if missing else {}
    etree.SubElement(root, "compiler", **least, discardvisual="false", fusestatic="false")
    try:
        spec = mujoco.MjSpec.from_string(etree.tostring(root, encoding="unicode"), assets=files)
        model = spec.compile()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        reason, size = shortened(" ".join(str(error).split()), 150), 1e-6 * sum(map(len, files.values()))
        advice = "correct it or give another"
        if size > _LARGE:
            advice = (
                f"its meshes have {size:.0f} MB, perhaps more than the import's memory is for: simplify them"
            )
        raise Refusal(source, f"MuJoCo cannot compile it ({reason}); {advice}") from None
    findings += [Finding("repaired", source, _RADIANS)] if turns else []
    text = f"{len(missing)} mesh file(s) not found ({listed(missing.values())})"
    text += "" if folder else "; a zip of the robot's folder brings them along"
    findings += [Finding("note", "meshes", text)] if missing else []
    return Compiled(spec.modelname, model, meshes, keys, tuple(findings))


def _parsed(data: bytes, source: str, findings: list[Finding]) -> Element:
    root = read_xml(data, source, findings)
    if len(data) > MAX_BYTES or root.getroottree().docinfo.doctype:
        raise Refusal(
            source, f"it has a DOCTYPE or more than {MAX_BYTES / 1e6:.0f} MB; remove what is not needed"
        )
    return root


def _include(
    root: Element, source: str, folder: Path | None, within: Path | None, findings: list[Finding]
) -> None:
    """Replaces each `include` by the content of its file. As in MuJoCo, paths are relative to the main
    file."""
    for _ in range(_INCLUDES):
        element = next(root.iter("include"), None)
        parent = None if element is None else element.getparent()
        if element is None or parent is None:
            return
        name = element.get("file", "")
        _, path = mesh_file(name, folder, within)
        if path is None:
            hint = (
                "is not found; put it beside the model"
                if folder
                else "is not part of an upload; upload a zip of its folder"
            )
            raise Refusal(source, f"the included file '{shortened(name)}' {hint}")
        parent[parent.index(element) : parent.index(element) + 1] = [
            *_parsed(load_bytes(path), shortened(name), findings)
        ]
    raise Refusal(source, f"it includes more than {_INCLUDES} files, or a file includes itself")


def _in_radians(root: Element) -> bool:
    """Whether the angles are in radians although no compiler says so: parts of models that are completed by a
    program leave it out. In degrees, no joint would turn further than two turns of radians have numbers."""
    if any(compiler.get("angle") for compiler in root.iter("compiler")):
        return False
    try:
        turns = [
            abs(float(number))
            for joint in root.iter("joint")
            if joint.get("type", "hinge") == "hinge"
            for number in joint.get("range", "").split()
        ]
    except ValueError:  # MuJoCo's compiler names the fault
        return False
    return 0.0 < max(turns, default=0.0) <= _TURNS


def _meshes(
    root: Element, folder: Path | None, within: Path | None
) -> tuple[dict[str, bytes], dict[str, Path], dict[str, str]]:
    """Gives each mesh a name and a file of its own. Returns the content of the files, the path of each mesh,
    and the file's name of each mesh that is missing and was removed."""
    place, only_names = PurePosixPath(), False
    for compiler in root.iter("compiler"):
        place = PurePosixPath(compiler.get("meshdir", compiler.get("assetdir", str(place))))
        only_names = compiler.get("strippath", str(only_names).lower()) == "true"
        for attribute in ("meshdir", "assetdir", "texturedir", "strippath"):
            compiler.attrib.pop(attribute, None)
    files: dict[str, bytes] = {}
    paths: dict[str, Path] = {}
    missing: dict[str, str] = {}
    left = _MESHES
    for mesh in [mesh for mesh in root.iter("mesh") if mesh.get("file") is not None]:
        file = PurePosixPath(mesh.get("file", "").replace("\\", "/"))
        file = PurePosixPath(file.name) if only_names else file
        name = mesh.get("name") or file.stem
        mesh.set("name", name)
        path = mesh_file(str(place / file), folder, within)[1]
        left -= 0 if path is None else path.stat().st_size
        if path is None or left < 0:
            missing[name] = file.name
            _remove(mesh)
            continue
        key = f"{len(files)}{path.suffix}"
        files[key], paths[name] = path.read_bytes(), path
        mesh.set("file", key)
    return files, paths, missing


def _remove(element: Element) -> None:
    parent = element.getparent()
    if parent is not None:
        parent.remove(element)
