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
UNLIMITED = 1e6  # rad, m, rad/s, N·m: a limit of at least this size, or an infinite one, limits nothing
_INFINITE = re.compile(r"[+-]?(inf|infinity|\.inf)", re.IGNORECASE)
_EXPAND = "run `pip install xacro`, then `xacro FILE > robot.urdf`, and give the result"
_XACRO_HINT = f"; this is a xacro template: {_EXPAND}"
_HARMLESS = (80, 201)  # libxml2: two hyphens in a comment; a prefix without a namespace
_BEFORE_XML = re.compile(rb"\A(?:\s|<!--(?:(?!-->).)*-->)+(?=<\?xml)", re.DOTALL)
_DECLARED = re.compile(rb"""[^>]*encoding=["']([^"']*)""")
_LATIN_OR_UTF_8 = re.compile(rb"utf-?8|(us-)?ascii|(iso-?8859|latin)[-_]?1", re.IGNORECASE)
_BARE = re.compile(rb"&(?!(?:#\d+|#x[0-9A-Fa-f]+|[A-Za-z_][\w.-]*);)")
_TAG = re.compile(rb"<([A-Za-z_][\w:.-]*)")
_ASIDE = {b"<!--": b"-->", b"<?": b"?>", b"<!": b">"}
"""The beginnings and ends of what may precede the root element."""


class Refusal(Exception):
    """An element that cannot be used; the import turns it into a `refused` finding."""

    def __init__(self, where: str, text: str) -> None:
        super().__init__(f"{where}: {text}")
        self.finding = Finding("refused", where, text)


_LISTS = ("xyz", "rpy", "size", "scale", "rgba")


def parse(data: bytes, source: str) -> tuple[Element, list[Finding]]:
    """Returns the root element `robot` of a URDF document, and what had to be repaired or left out. Comments
    and foreign sections are removed.

    What other readers of URDF accept although it is not well-formed XML is accepted outside links and joints.
    No entity is resolved, no DTD is loaded and nothing is downloaded. Raises Refusal for a document that is
    too large, is not XML, declares a DTD, is a xacro template, or has another root element.
    """
    if len(data) > MAX_BYTES:
        raise Refusal(
            source, f"the file has {len(data) / 1e6:.0f} MB; give a URDF below {MAX_BYTES / 1e6:.0f} MB"
        )
    findings: list[Finding] = []
    root = read_xml(data, source, findings, ("link", "joint"))
    _drop_namespace(root, source, findings)
    if root.tag != "robot":
        text = f"the root element is <{shortened(str(root.tag))}>, a URDF starts with <robot>"
        raise Refusal(source, f"{text}; give a URDF, or a MuJoCo model, which starts with <mujoco>")
    if root.getroottree().docinfo.doctype:
        raise Refusal(source, "the file declares a DOCTYPE, which a URDF never needs; remove it")
    _drop_xacro(root, source, findings)
    for child in list(root):
        if child.tag not in ("link", "joint", "material"):
            root.remove(child)
    for each in root.iter():
        for key in [key for key in each.attrib if ":" in str(key) and not str(key).startswith("{")]:
            del each.attrib[key]  # its prefix is not declared, so the document could not be read again
    lists = [(each, key) for each in root.iter() for key in _LISTS if "," in each.get(key, "")]
    for element, key in lists:
        element.set(key, element.get(key, "").replace(",", " "))
    if lists:
        text = f"{len(lists)} list(s) of numbers had commas, which were read as spaces"
        findings.append(Finding("repaired", source, text))
    if not root.get("name", "").strip():
        root.set("name", "robot")
        findings.append(Finding("filled", source, "<robot> has no name; the name 'robot' was used"))
    return root, findings


def _as_unicode(data: bytes, source: str, findings: list[Finding]) -> tuple[bytes, str | None]:
    """Returns the document without what may not precede its declaration, and its encoding; None: the one that
    it declares. Bytes that are UTF-8 are that whatever the document says, and other bytes are Latin-1 if it
    does not say what else they are."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in data[:4]:
        return data, None  # UTF-16
    data = _BEFORE_XML.sub(b"", data.removeprefix(b"\xef\xbb\xbf"), count=1).rstrip(b"\0 \t\r\n")
    try:
        data.decode()
    except UnicodeDecodeError:
        declared = _DECLARED.match(data[:200])
        if declared is not None and not _LATIN_OR_UTF_8.fullmatch(declared[1]):
            return data, None
        findings.append(Finding("repaired", source, "it is not UTF-8 and was read as Latin-1"))
        data = data.decode("latin-1").encode()
    return data, "utf-8"


def parser(recover: bool = False, encoding: str | None = None) -> etree.XMLParser:
    """Returns a parser that resolves no entity, loads no DTD and downloads nothing."""
    return etree.XMLParser(
        encoding=encoding,
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        remove_comments=True,
        remove_pis=True,
        recover=recover,
    )


def read_xml(
    data: bytes, source: str, findings: list[Finding], parts: tuple[str, ...] | None = None
) -> Element:
    """Returns the root element. A document that is not well-formed is read again, as other readers do, if
    what it describes is not damaged.

    parts: the children of the root element that may not have a fault; None: nothing may have one. Raises
    Refusal for a document that cannot be read.
    """
    data, encoding = _as_unicode(data, source, findings)
    try:
        return etree.fromstring(data, parser(encoding=encoding))
    except (etree.XMLSyntaxError, ValueError) as error:
        reason = _first_line(error)
    data, count = _BARE.subn(b"&amp;", data)
    if count:
        findings.append(Finding("repaired", source, f"{count} ampersand(s) are not written as &amp;"))
    lenient = parser(True, encoding)
    try:
        root = etree.fromstring(data, lenient)
    except (etree.XMLSyntaxError, ValueError):
        root = None
    faults = [(fault.line, fault.type) for fault in lenient.error_log]
    if root is None or len(root) == 0 or any(_damages(root, parts, *fault) for fault in faults):
        raise Refusal(source, f"this is not well-formed XML ({reason}); correct it or give another file")
    if faults:
        lost = "no link and no joint is affected" if parts else "nothing is lost"
        findings.append(Finding("repaired", source, f"it is not well-formed XML ({reason}); {lost}"))
    return root


def _damages(root: Element, parts: tuple[str, ...] | None, line: int, kind: int) -> bool:
    """Whether a fault in this line can have damaged one of these parts."""
    if kind in _HARMLESS:
        return False
    before = [child for child in root if (child.sourceline or 0) <= line]
    return parts is None or not before or before[-1].tag in parts


def _drop_namespace(root: Element, source: str, findings: list[Finding]) -> None:
    space = etree.QName(root).namespace
    if space is None:
        return
    kind = "default namespace" if root.prefix is None else "namespace"
    for element in root.iter(f"{{{space}}}*"):
        element.tag = etree.QName(element).localname
    etree.cleanup_namespaces(root)
    findings.append(Finding("note", source, f"its {kind} '{shortened(space)}' was left out"))


def _drop_xacro(root: Element, source: str, findings: list[Finding]) -> None:
    """Removes left-over elements of xacro. Raises Refusal for a template: values of links or joints are still
    to be computed, or all joints or some links are still to be added."""
    left_over = [element for element in root.iter() if "xacro" in str(element.tag)]
    for element in left_over:
        parent = element.getparent()
        if parent is not None:
            parent.remove(element)
    unfinished = root.xpath(
        "boolean(//*[self::link or self::joint or self::parent or self::child]"
        "[@*[contains(., '${') or contains(., '$(')]])"
    )  # `attrib.values()` takes a time that grows with the square of the number of attributes
    calls = sum("property" not in str(element.tag) for element in left_over)
    links = {"", "world", *named(root, "link")}
    used = {end_of(joint, side) for joint in root.findall("joint") for side in ("parent", "child")}
    if unfinished or (left_over and root.find("joint") is None) or (calls and not used <= links):
        raise Refusal(source, f"this is a xacro template; {_EXPAND}")
    if left_over:
        text = f"{len(left_over)} left-over element(s) of xacro were left out"
        text += f"; {calls} of them may have described links, sensors or colours" if calls else ""
        findings.append(Finding("note", source, text))


def load_bytes(path: Path, most: int = MAX_BYTES, name: str = "") -> bytes:
    """Returns the content of a file, at most one byte more than `most`, as many as the parser accepts. name:
    the file's name in the message.

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
                return file.read(most + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "this is not a valid path"
    name = shortened(name or str(path), 100)
    raise InputError(f"Cannot read the URDF '{name}': {reason}; give the path of a URDF file.")


def root_tag(data: bytes) -> str:
    """Returns the name of the root element of an XML document, from its first megabyte; "" if there is
    none."""
    data, at = data[:1_000_000], 0
    while (at := data.find(b"<", at)) >= 0:
        end = next((end for begin, end in _ASIDE.items() if data.startswith(begin, at)), None)
        if end is None:
            found = _TAG.match(data, at)
            return "" if found is None else found[1].decode()
        at = data.find(end, at)
        if at < 0:
            break
    return ""


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
        hint = _XACRO_HINT if "${" in text or "$(" in text else ""
        raise Refusal(where, f"{name} is '{shortened(text)}', not {_count(count)}{hint}") from None
    known = len(words) == count and all(_NUMBER.fullmatch(word) for word in words)
    if not known or not all(math.isfinite(value) for value in values):
        raise Refusal(where, f"{name} is '{shortened(text)}', not {_count(count)}")
    if max(abs(value) for value in values) > _LARGEST.get(attribute, 1e9):
        raise Refusal(where, f"{name} is '{shortened(text)}', too large for a real robot; check its unit")
    return np.array(values)


def limit_value(limit: Element, attribute: str) -> float:
    """Returns a limit; ±inf if it is infinite or so large that it limits nothing, 0 if it is missing. Raises
    Refusal like `numbers`."""
    text = limit.get(attribute, "").strip()
    if _INFINITE.fullmatch(text):
        return -math.inf if text.startswith("-") else math.inf
    if _NUMBER.fullmatch(text) and abs(value := float(text)) >= UNLIMITED:
        return math.copysign(math.inf, value)
    return float(numbers(limit, attribute, 1, (0.0,))[0])


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
