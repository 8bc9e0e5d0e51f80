"""The tip of a robot if nobody names one: a link of the hand, found by the tree of joints and by its name."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Container
from itertools import count

from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import InputError, shortened
from robots.urdf.joints import GRIPPER
from robots.urdf.read import end_of, named
from robots.urdf.structure import chains, reached

_NAMES = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        r"tcp|tool_?0|tool_?frame|tool_?cent|grasp|(?<![a-z])ee(?![a-z])|ee_?link|eef|end_?effector",
        r"flange|tool",
        r"gripper|hand|palm",
    )
)
"""Names of frames that are made to be the tip; earlier ones are preferred."""
_LEG = re.compile(r"(?<![a-z])leg|thigh|knee|shin|calf|foot|ankle|toe|sole|wheel|caster", re.IGNORECASE)
_PART = re.compile(
    r"finger|knuckle|thumb|jaw|(?<![a-z])pad|mover|camera|sensor|optical|imu|lidar|range|meter", re.IGNORECASE
)
"""Parts of a hand whose frames are turned or displaced from the axis of the hand."""


TOOL = "@"
"""Separates the name of a tip from the place of a tool that it carries."""
_FAR = 10.0  # m, rad: the largest number of a tool's place


def add_tool(root: Element, carrier: str, place: str) -> str:
    """Adds a frame to a link, and returns the frame's name. place: "x,y,z" or "x,y,z,roll,pitch,yaw" in the
    frame of the link, m and rad. Raises InputError for anything else."""
    try:
        numbers = [float(number) for number in place.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (3, 6) or not all(math.isfinite(x) and abs(x) <= _FAR for x in numbers):
        raise InputError(
            f"The place '{shortened(place)}' of a tool is not x,y,z or x,y,z,roll,pitch,yaw, in m and rad, "
            f"each at most {_FAR:g}: give for example --tool 0,0,0.1."
        )
    name = _free(named(root, "link"))
    etree.SubElement(root, "link", name=name)
    joint = etree.SubElement(root, "joint", name=_free(named(root, "joint")), type="fixed")
    etree.SubElement(joint, "parent", link=carrier)
    etree.SubElement(joint, "child", link=name)
    xyz, rpy = (" ".join(map(repr, part)) for part in (numbers[:3], numbers[3:] or (0.0, 0.0, 0.0)))
    etree.SubElement(joint, "origin", xyz=xyz, rpy=rpy)
    return name


def _free(taken: Container[str]) -> str:
    names = (f"tool_{k}" if k else "tool" for k in count())
    return next(name for name in names if name not in taken)


def choose_tip(root: Element) -> tuple[str, tuple[str, ...]]:
    """Returns the tip and the frames that are as likely.

    The tip is at the end of the longest chain of joints that is not a leg. If several chains leave one body
    behind the middle of this chain and behind its fourth joint, they are fingers, and the tip is on that
    body. Frames of fingers, jaws and sensors are used only if there are no others. Frames with names such as
    `tool0` are preferred, in alphabetical order; otherwise the tip is the last frame, if possible one that no
    joint of a gripper carries, with more than a collision shape.
    """
    carried = chains(root)
    arms = not_legs(root)
    chain = max((carried[name] for name in arms), key=len)
    branches = Counter(above[-2] for above in set(carried.values()) if len(above) > 1)
    palms = [k for k in range(max(len(chain) // 2 + 1, 4), len(chain)) if branches[chain[k - 1]] >= 2]
    length = palms[0] if palms else len(chain)
    ends = [
        name
        for name in arms
        if len(carried[name]) == length and not (palms and branches[carried[name][-1]] < 2)
    ]
    hands = [name for name in ends if not _PART.search(name)] or ends
    for pattern in _NAMES:
        alike = sorted(name for name in hands if pattern.search(name))
        if alike:
            return alike[0], tuple(alike[1:])
    links, parts = named(root, "link"), _in_gripper(root)
    hands = [name for name in hands if name not in parts] or hands
    seen = [name for name in hands if not _invisible(links[name])] or hands
    return seen[-1], tuple(seen[:-1])


def not_legs(root: Element) -> list[str]:
    """Returns the links that are not at the end of a leg, and carry none by a joint, as a pelvis does; all
    links if no arm with three joints remains."""
    carried = chains(root)
    legs = {name for name in carried if _LEG.search(name)}
    carriers = {carried[leg][:count] for leg in legs for count in range(1, len(carried[leg]))}
    arms = [name for name in carried if name not in legs and carried[name] not in carriers]
    return arms if max((len(carried[name]) for name in arms), default=0) >= 3 else list(carried)


def _in_gripper(root: Element) -> set[str]:
    """Returns the links that joints of a gripper carry, directly or not."""
    joints = root.findall("joint")
    return reached((end_of(joint, "child") for joint in joints if joint.get(GRIPPER) is not None), joints)


def _invisible(link: Element) -> bool:
    return link.find("collision") is not None and link.find("visual") is None
