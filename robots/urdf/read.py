"""Reads the XML of a URDF safely, and its numbers strictly."""

from __future__ import annotations

import copy
import math
import re
from pathlib import Path

import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import InputError, shortened
from robots.report import Finding

MAX_BYTES = 10_000_000
_LARGEST = {"xyz": 1e3, "value": 1e5}  # m and kg: with larger numbers, sums of inertias lose all digits
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
"""The format of numbers that C++ readers of URDF accept; Python also accepts other formats."""
_XACRO_HINT = "; is this a xacro file? Run `xacro FILE > robot.urdf` first"


class Refusal(Exception):
    """An element that cannot be used; the import turns it into a `refused` finding."""

    def __init__(self, where: str, text: str) -> None:
        super().__init__(f"{where}: {text}")
        self.finding = Finding("refused", where, text)


def parse(data: bytes, source: str) -> Element:
    """Returns the root element `robot` of a URDF document. Comments and foreign sections are removed.

    No entity is resolved, no DTD is loaded and nothing is downloaded. Raises Refusal for a document that is
    too large, is not XML, declares a DTD, is a xacro template, or has another root element.
    """
    if len(data) > MAX_BYTES:
        raise Refusal(
            source, f"the file has {len(data) / 1e6:.0f} MB; give a URDF below {MAX_BYTES / 1e6:.0f} MB"
        )
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True, remove_pis=True
    )
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise Refusal(
            source, f"this is not well-formed XML ({_first_line(error)}); give a URDF file"
        ) from None
    if root.getroottree().docinfo.doctype:
        raise Refusal(source, "the file declares a DOCTYPE, which a URDF never needs; remove it")
    if any("xacro" in str(element.tag) for element in root.iter()):
        raise Refusal(source, "this is a xacro template; run `xacro FILE > robot.urdf` and give the result")
    if root.tag != "robot":
        raise Refusal(source, f"the root element is <{shortened(str(root.tag))}>, a URDF starts with <robot>")
    for child in list(root):
        if child.tag not in ("link", "joint", "material"):
            root.remove(child)
    return root


def load_bytes(path: Path) -> bytes:
    """Returns the content of a URDF file, at most one byte more than the parser accepts.

    Raises InputError if the path cannot be read or is not a regular file: a read from a pipe could block for
    ever.
    """
    try:
        if path.is_dir():
            reason = "it is a folder"
        elif path.exists() and not path.is_file():
            reason = "it is not a regular file"
        else:
            with path.open("rb") as file:
                return file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "this is not a valid path"
    name = shortened(str(path), 100)
    raise InputError(f"Cannot read the URDF '{name}': {reason}; give the path of a URDF file.")


def label(element: Element) -> str:
    """Returns the name of an element for findings, such as ``joint 'elbow'``."""
    return f"{element.tag} '{shortened(element.get('name', ''))}'"


def numbers(
    element: Element, attribute: str, count: int, default: tuple[float, ...] | None = None
) -> np.ndarray:
    """Returns `count` finite numbers of an attribute. Raises Refusal if they are missing or are not
    numbers."""
    text = element.get(attribute)
    where = _owner(element)
    name = f"{element.tag} {attribute}"
    if text is None or not text.strip():
        if default is None:
            raise Refusal(where, f"{name} is missing; it needs {count} number{'s' * (count > 1)}")
        if text is not None:
            del element.attrib[attribute]  # other readers do not accept an empty number
        return np.array(default, dtype=float)
    words = text.split()
    try:
        values = [float(word) for word in words]
    except ValueError:
        hint = _XACRO_HINT if "${" in text else ""
        raise Refusal(where, f"{name} is '{shortened(text)}', not {_count(count)}{hint}") from None
    known = len(words) == count and all(_NUMBER.fullmatch(word) for word in words)
    if not known or not all(math.isfinite(value) for value in values):
        raise Refusal(where, f"{name} is '{shortened(text)}', not {_count(count)}")
    if max(abs(value) for value in values) > _LARGEST.get(attribute, 1e9):
        raise Refusal(where, f"{name} is '{shortened(text)}', too large for a real robot; check its unit")
    return np.array(values)


def placement(element: Element) -> pin.SE3:
    """Returns the `origin` of an element. Raises Refusal like `numbers`."""
    origin = element.find("origin")
    if origin is None:
        return pin.SE3.Identity()
    xyz, rpy = (numbers(origin, name, 3, (0.0, 0.0, 0.0)) for name in ("xyz", "rpy"))
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)


def without_shapes(root: Element) -> str:
    """Returns the document without visual and collision shapes, which readers of kinematics do not need."""
    bare = copy.deepcopy(root)
    for material in bare.findall("material"):
        bare.remove(material)
    for link in bare.findall("link"):
        for tag in ("visual", "collision"):
            for shape in link.findall(tag):
                link.remove(shape)
    return etree.tostring(bare, encoding="unicode")


def named(root: Element, tag: str) -> dict[str, Element]:
    """Returns the direct children with this tag, by name, in the file's order."""
    return {element.get("name", ""): element for element in root.findall(tag)}


def end_of(joint: Element, side: str) -> str:
    """Returns the link that a joint names as its `parent` or `child` ('' if it names none)."""
    element = joint.find(side)
    return "" if element is None else element.get("link", "")


def _owner(element: Element) -> str:
    current: Element | None = element
    while current is not None and current.get("name") is None:
        current = current.getparent()
    return label(element if current is None else current)


def _count(count: int) -> str:
    return "a finite number" if count == 1 else f"{count} finite numbers"


def _first_line(error: Exception) -> str:
    text = str(getattr(error, "msg", error)).strip()
    return shortened(text.splitlines()[0], 150) if text else type(error).__name__
