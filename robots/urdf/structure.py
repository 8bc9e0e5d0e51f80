"""The tree of a URDF: every link and joint named once, one root, no loop, only joints with one axis."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from difflib import get_close_matches

from lxml.etree import _Element as Element

from robots.report import Finding
from robots.urdf.read import Refusal, end_of, label, named

MOVABLE = ("revolute", "continuous", "prismatic")
_KNOWN = (*MOVABLE, "fixed", "floating", "planar")


def check_structure(root: Element, source: str) -> Iterator[Finding]:
    """Yields a `refused` finding for everything that keeps the description from being one tree of links."""
    faults = [*_names(root), *_joint_ends(root), *_types(root)]
    yield from faults
    if not faults:
        yield from _single_tree(root, source)


def movable_joints(root: Element) -> list[Element]:
    """The joints that still move, in the file's order."""
    return [joint for joint in root.findall("joint") if joint.get("type") in MOVABLE]


def parent_joints(root: Element) -> dict[str, Element]:
    """For every link but the root: the joint that carries it."""
    return {end_of(joint, "child"): joint for joint in root.findall("joint")}


def ancestors(root: Element, link: str) -> Iterator[Element]:
    """The joints from a link down to the root, nearest first."""
    carriers = parent_joints(root)
    while link in carriers:
        yield carriers[link]
        link = end_of(carriers[link], "parent")


def _names(root: Element) -> Iterator[Finding]:
    for tag in ("link", "joint"):
        counts = Counter(element.get("name", "") for element in root.findall(tag))
        for name, count in counts.items():
            if not name.strip():
                yield Finding("refused", tag, f"{count} {tag}(s) have no name; name every {tag}")
            elif count > 1:
                yield Finding(
                    "refused", f"{tag} '{name}'", f"the name is used {count} times; make names unique"
                )
    if "universe" in named(root, "link"):
        yield Finding("refused", "link 'universe'", "the name is reserved for the world; rename the link")
    if not root.findall("link"):
        yield Finding("refused", "robot", "it has no link; a robot needs at least two links and a joint")


def _joint_ends(root: Element) -> Iterator[Finding]:
    links = named(root, "link")
    for joint in root.findall("joint"):
        for side in ("parent", "child"):
            name = end_of(joint, side)
            if name not in links:
                close = get_close_matches(name, links, n=1)
                guess = f"; did you mean '{close[0]}'?" if close else "; add that link or correct the name"
                yield Finding("refused", label(joint), f"its {side} link '{name}' does not exist{guess}")
    children = Counter(end_of(joint, "child") for joint in root.findall("joint"))
    for name, count in children.items():
        if count > 1:
            yield Finding(
                "refused", f"link '{name}'", f"{count} joints carry it; closed chains are not supported"
            )


def _types(root: Element) -> Iterator[Finding]:
    for joint in root.findall("joint"):
        kind = joint.get("type", "")
        if kind in ("floating", "planar"):
            text = f"a {kind} joint has several axes; only fixed-base robots with one-axis joints work"
            yield Finding("refused", label(joint), text)
        elif kind not in _KNOWN:
            close = get_close_matches(kind, _KNOWN, n=1)
            guess = f"did you mean '{close[0]}'? " if close else ""
            yield Finding(
                "refused", label(joint), f"unknown type '{kind}'; {guess}Use one of {', '.join(_KNOWN[:4])}"
            )


def _single_tree(root: Element, source: str) -> Iterator[Finding]:
    links = named(root, "link")
    carried = parent_joints(root)
    roots = [name for name in links if name not in carried]
    if not roots:
        yield Finding("refused", source, "no link is the root: the joints form a loop; open it")
    elif len(roots) > 1:
        names = ", ".join(f"'{name}'" for name in roots[:6]) + (", …" if len(roots) > 6 else "")
        yield Finding(
            "refused", source, f"it has {len(roots)} root links ({names}); join them with fixed joints"
        )
    elif len(_below(root, roots[0])) != len(links):
        yield Finding("refused", source, "some joints form a loop apart from the root link; open it")


def _below(root: Element, start: str) -> set[str]:
    children: dict[str, list[str]] = {}
    for joint in root.findall("joint"):
        children.setdefault(end_of(joint, "parent"), []).append(end_of(joint, "child"))
    seen, open_links = {start}, [start]
    while open_links:
        for name in children.get(open_links.pop(), []):
            if name in seen:
                raise Refusal(f"link '{name}'", "it is reached twice; closed chains are not supported")
            seen.add(name)
            open_links.append(name)
    return seen
