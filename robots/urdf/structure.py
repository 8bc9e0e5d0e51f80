"""Checks the tree of a URDF: unique names of links and joints, one root, no loops, and only joints with one
axis."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import listed, nearest_name, shortened
from robots.report import Finding
from robots.urdf.read import end_of, label, named

MAX_LINKS = 1_000
MAX_SHAPES = 5_000
MAX_DEPTH = 200
"""Largest number of joints in a chain. Readers of URDF are recursive functions, with one call per joint of a
chain."""
MAX_NAME = 100
HOME = "home"
"""Attribute of a joint with its value in the posture from which the robot starts, rad or m. Other readers
ignore it."""
UNDERACTUATED = "underactuated"
"""Attribute of a robot that leaves joints without an actuator on purpose. Other readers ignore it."""
MOVABLE = ("revolute", "continuous", "prismatic")
_KNOWN = (*MOVABLE, "fixed", "floating", "planar")
_GUESSES = 5
"""Largest number of findings with a suggested name. They show how to correct the other findings."""


def check_structure(root: Element, source: str) -> Iterator[Finding]:
    """Yields a `refused` finding for every fault that prevents the description from being a single tree of
    links."""
    yield from _repaired_roots(root)
    for checks in ((_sizes,), (_names,), (_joint_ends, _types), (_single_tree,)):
        faults = [fault for check in checks for fault in check(root, source)]
        yield from faults
        if faults:
            return


def movable_joints(root: Element) -> list[Element]:
    """Returns the joints that are neither fixed nor follow another joint, in the file's order."""
    return [joint for joint in root.findall("joint") if _moves(joint)]


def followers(root: Element) -> list[Element]:
    """Returns the joints that follow (mimic) another joint and are not fixed, in the file's order."""
    joints = (joint for joint in root.findall("joint") if joint.get("type") in MOVABLE)
    return [joint for joint in joints if joint.find("mimic") is not None]


def resting(joint: Element) -> float:
    """Returns the value at which a joint stands if nobody gives another one, rad or m: that of the file's
    home, or 0."""
    try:
        value = float(joint.get(HOME, "0"))
    except ValueError:
        return 0.0
    return value if abs(value) < 1e6 else 0.0  # false for NaN


def _moves(joint: Element) -> bool:
    return joint.get("type") in MOVABLE and joint.find("mimic") is None


def parent_joints(root: Element) -> dict[str, Element]:
    """Returns, for every link except the root, the joint that carries the link."""
    return {end_of(joint, "child"): joint for joint in root.findall("joint")}


def reached(links: Iterable[str], joints: Iterable[Element]) -> set[str]:
    """Returns some links, and all links that these joints connect to them on the way to the tips."""
    below, found, ahead = dict[str, list[str]](), set[str](), list(links)
    for joint in joints:
        below.setdefault(end_of(joint, "parent"), []).append(end_of(joint, "child"))
    while ahead:
        link = ahead.pop()
        ahead += () if link in found else below.get(link, ())
        found.add(link)
    return found


def chains(root: Element) -> dict[str, tuple[str, ...]]:
    """Returns, for every link, the names of the moving joints that carry it, from the base on."""
    carriers = parent_joints(root)
    found: dict[str, tuple[str, ...]] = {}
    for link in named(root, "link"):
        passed, at = [], link
        while at not in found and at in carriers:
            passed.append(at)
            at = end_of(carriers[at], "parent")
        below = found.setdefault(at, ())
        for each in reversed(passed):
            if _moves(carriers[each]):
                below = (*below, carriers[each].get("name", ""))
            found[each] = below
    return {link: found[link] for link in named(root, "link")}


def body_of(root: Element) -> dict[str, str]:
    """Returns, for every link, the first link of its rigid body: the link that a moving joint carries."""
    carriers = parent_joints(root)
    found: dict[str, str] = {}
    for link in named(root, "link"):
        passed, at = [link], link
        while at not in found and at in carriers and carriers[at].get("type") == "fixed":
            at = end_of(carriers[at], "parent")
            passed.append(at)
        first = found.get(at, at)
        found.update((each, first) for each in passed)
    return found


def _repaired_roots(root: Element) -> Iterator[Finding]:
    """Adds the link `world` if joints use it without its being described, and welds a base that a floating or
    planar joint carries."""
    still = _still(root)
    for joint in root.findall("joint"):
        parent = end_of(joint, "parent")
        if parent == "world" and "world" not in named(root, "link"):
            etree.SubElement(root, "link", name="world")
            yield Finding("filled", label(joint), "its parent link 'world' is not described and was added")
        if parent in still and (kind := joint.get("type")) in ("floating", "planar"):
            joint.set("type", "fixed")
            text = f"a {kind} joint carries the base; it was made fixed: only fixed bases can be controlled"
            yield Finding("fixed", label(joint), text)


def _still(root: Element) -> set[str]:
    """Returns the links that no one-axis joint carries, so that they stand still if nothing floats."""
    others = [joint for joint in root.findall("joint") if joint.get("type") not in MOVABLE]
    return reached({end_of(joint, "parent") for joint in others} - parent_joints(root).keys(), others)


def _sizes(root: Element, source: str) -> Iterator[Finding]:
    links, joints = len(root.findall("link")), len(root.findall("joint"))
    if max(links, joints) > MAX_LINKS:
        text = f"it has {links} links and {joints} joints; at most {MAX_LINKS} of each can be used"
        yield Finding("refused", source, text)
    shapes = sum(len(link.findall(tag)) for link in root.findall("link") for tag in ("visual", "collision"))
    if shapes > MAX_SHAPES:
        text = f"it has {shapes} visual and collision shapes; at most {MAX_SHAPES} can be used"
        yield Finding("refused", source, text)


def _names(root: Element, _source: str) -> Iterator[Finding]:
    for tag in ("link", "joint"):
        counts = Counter(element.get("name", "") for element in root.findall(tag))
        for name, count in counts.items():
            where = f"{tag} '{shortened(name)}'"
            if not name.strip():
                yield Finding("refused", tag, f"{count} {tag}(s) have no name; name every {tag}")
            elif count > 1:
                yield Finding("refused", where, f"the name is used {count} times; make names unique")
            elif len(name) > MAX_NAME:
                yield Finding(
                    "refused", where, f"its name has {len(name)} characters; at most {MAX_NAME} are allowed"
                )
            elif not name.isprintable():
                yield Finding("refused", where, "the name has characters that cannot be printed; rename it")
    if "universe" in named(root, "link"):
        yield Finding("refused", "link 'universe'", "the name is reserved for the world; rename the link")
    if not root.findall("link"):
        yield Finding("refused", "robot", "it has no link; a robot needs at least two links and a joint")


def _joint_ends(root: Element, _source: str) -> Iterator[Finding]:
    links = named(root, "link")
    guesses = 0
    for joint in root.findall("joint"):
        for side in ("parent", "child"):
            name = end_of(joint, side)
            if name not in links:
                guesses += 1
                close = nearest_name(name, links) if guesses <= _GUESSES else None
                guess = f"; did you mean '{close}'?" if close else "; add that link or correct the name"
                text = f"its {side} link '{shortened(name)}' does not exist{guess}"
                yield Finding("refused", label(joint), text)
    children = Counter(end_of(joint, "child") for joint in root.findall("joint"))
    for name, count in children.items():
        if count > 1:
            text = f"{count} joints carry it; closed chains are not supported"
            yield Finding("refused", f"link '{shortened(name)}'", text)


def _types(root: Element, _source: str) -> Iterator[Finding]:
    guesses = 0
    for joint in root.findall("joint"):
        kind = joint.get("type", "")
        if kind in ("floating", "planar"):
            text = f"a {kind} joint has several axes; only fixed-base robots with one-axis joints work"
            text += "; make it fixed"
            yield Finding("refused", label(joint), text)
        elif kind not in _KNOWN:
            guesses += 1
            close = nearest_name(kind, _KNOWN) if guesses <= _GUESSES else None
            guess = f"did you mean '{close}'? " if close else ""
            text = f"unknown type '{shortened(kind)}'; {guess}Use one of {', '.join(_KNOWN[:4])}"
            yield Finding("refused", label(joint), text)


def _single_tree(root: Element, source: str) -> Iterator[Finding]:
    links = named(root, "link")
    carried = parent_joints(root)
    roots = [name for name in links if name not in carried]
    if not roots:
        yield Finding("refused", source, "no link is the root: the joints form a loop; open the loop")
        return
    if len(roots) > 1:
        text = f"it has {len(roots)} root links ({listed(roots, 6, 30)}); join them with fixed joints"
        yield Finding("refused", source, text)
        return
    depths = _depths(root, roots[0])
    if len(depths) != len(links):
        yield Finding("refused", source, "some joints form a loop without the root link; open the loop")
    elif max(depths.values()) > MAX_DEPTH:
        text = f"its longest chain has {max(depths.values())} joints; at most {MAX_DEPTH} can be used"
        yield Finding("refused", source, text)


def _depths(root: Element, start: str) -> dict[str, int]:
    """Returns the number of joints between the root link and each of its descendants."""
    children: dict[str, list[str]] = {}
    for joint in root.findall("joint"):
        children.setdefault(end_of(joint, "parent"), []).append(end_of(joint, "child"))
    depths, open_links = {start: 0}, [start]
    while open_links:
        link = open_links.pop()
        for name in children.get(link, []):
            depths[name] = depths[link] + 1
            open_links.append(name)
    return depths
