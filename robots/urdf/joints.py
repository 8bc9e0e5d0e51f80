"""Normalises the joints of a URDF: axes get unit length, `continuous` joints become revolute, joints of
grippers become fixed, and so do joints that follow (mimic) a held one, where their leader puts them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import shortened
from robots.report import Finding
from robots.urdf.read import (
    UNLIMITED,
    Refusal,
    end_of,
    label,
    limit_value,
    named,
    numbers,
    placement,
    without_shapes,
)
from robots.urdf.structure import followers, movable_joints, parent_joints, resting

UNBOUNDED = UNLIMITED  # limit of a joint without limits, so that nq = nv; it is read as ±inf
_TURNS = 4.0 * math.pi  # rad: no arm's joint turns further, but a limit in degrees says so
_GRIPPER_JOINT = re.compile(r"finger|knuckle|gripper|thumb|jaw", re.IGNORECASE)
_GRIPPER_LINK = re.compile(r"finger|knuckle|thumb", re.IGNORECASE)  # "gripper" also names whole hands
HELD = "held"
"""Attribute with the value at which a joint was made fixed; the canonical form does not have it."""
GRIPPER = "gripper"
"""Attribute of a joint of a gripper, which is held or follows such a joint; the canonical form does not have
it."""


def normalise_joints(root: Element, held: dict[str, tuple[float, str]]) -> Iterator[Finding]:
    """Rewrites all joints so that each has exactly one coordinate in Pinocchio; yields the changes.

    held: the joints that a user holds, as name → (value in rad or m, reason).
    """
    try:
        frozen, unlimited = _to_freeze(root, held), _without_range(root)
        _mark_grippers(root, frozen.keys() - held.keys())
    except Refusal as refusal:
        yield refusal.finding
        return
    for joint in root.findall("joint"):
        try:
            placement(joint)
            joint.attrib.pop(HELD, None)
            _drop(joint, "calibration", "safety_controller")
            if joint.get("type") == "fixed":
                _drop(joint, "limit", "axis", "mimic", "dynamics")
                continue
            _keep_armature(joint)
            yield from _axis(joint)
            yield from _limits(joint, joint in unlimited)
            if joint.get("name") in frozen:
                yield freeze(joint, *frozen[joint.get("name", "")])
            elif joint.find("mimic") is None:
                yield from _freeze_if_stuck(joint)
        except Refusal as refusal:
            yield refusal.finding


def _mark_grippers(root: Element, driven: set[str]) -> None:
    """Marks the joints with these names, and those that follow them."""
    joints = named(root, "joint")
    for name, joint in joints.items():
        joint.attrib.pop(GRIPPER, None)
        if name in driven or (joint.find("mimic") is not None and _first_leader(joint, joints) in driven):
            joint.set(GRIPPER, "true")


def freeze(joint: Element, value: float, reason: str) -> Finding:
    """Makes a joint fixed at `value` (rad or m), which is clipped to the joint's limits, and adds this motion
    to the joint's origin."""
    limit = joint.find("limit")
    if limit is not None:
        value = float(np.clip(value, *_ends(limit)))
    axis = numbers(_require(joint, "axis"), "xyz", 3)
    if joint.get("type") == "prismatic":
        motion = pin.SE3(np.eye(3), axis * value)
    else:
        motion = pin.SE3(pin.exp3(axis * value), np.zeros(3))
    if value != 0.0:
        placed = placement(joint) * motion
        origin = joint.find("origin")
        if origin is None:
            origin = etree.SubElement(joint, "origin")
        origin.set("xyz", _text(placed.translation))
        origin.set("rpy", _text(pin.rpy.matrixToRpy(placed.rotation)))
    unit = "m" if joint.get("type") == "prismatic" else "rad"
    joint.set("type", "fixed")
    joint.set(HELD, repr(value))
    _drop(joint, "limit", "axis", "mimic", "dynamics")
    return Finding("fixed", label(joint), f"held at {value:.4g} {unit}: {reason}")


def settle_followers(root: Element) -> Iterator[Finding]:
    """Decides for each joint that follows (mimics) another one whether it moves.

    Of joints that move together, the first in the tree gets the coordinate. A follower of a moving joint
    moves: its element `mimic` then names a joint with a coordinate of its own, and the range of this joint is
    cut so that the follower stays in its own range. It is fixed if its leader is held, at multiplier · q +
    offset, where q is the value at which the leader is held; or if the motion cannot be simulated. The leader
    is then thought to be at the file's home, or at 0, within its limits.
    """
    joints, places = named(root, "joint"), _places(root) if followers(root) else {}
    yield from _turned_around(root, places)
    following = {joint.get("name", ""): joint for joint in followers(root)}
    moving = {joint.get("name", "") for joint in movable_joints(root)}
    settled = set[str]()
    for first in list(following):
        chain: dict[str, None] = {}
        name = first
        while name in following and name not in chain:
            chain[name] = None
            name = _leader(following[name])
        for each in reversed(chain):
            joint = following.pop(each)
            leader = _leader(joint)
            try:
                why_not = _cannot_follow(joint, joints.get(leader), places, len(settled))
                if leader in moving and not why_not:
                    settled.add(each)
                    yield from _keep_range(joint, joints[coupling(joint)[0]])
                else:
                    yield freeze(joint, *_led(joint, leader, joints.get(leader), leader in moving, why_not))
            except Refusal as refusal:
                yield refusal.finding
            if leader in moving:
                moving.add(each)


def _turned_around(root: Element, places: dict[str, int]) -> Iterator[Finding]:
    """Makes a joint that comes before its leader in Pinocchio's tree the leader: q = (p − offset) /
    multiplier. Its effort limit and rotor inertia become those of the leader, as it moves."""
    joints, moving = named(root, "joint"), {joint.get("name", "") for joint in movable_joints(root)}
    for joint in sorted(followers(root), key=lambda each: places.get(each.get("name", ""), 0)):
        name, leader, seen = joint.get("name", ""), _leader(joint), set[str]()
        try:
            _, factor, offset = coupling(joint)
            while leader in joints and leader not in moving and leader not in seen:
                seen.add(leader)
                leader, first, start = coupling(joints[leader])
                factor, offset = factor * first, factor * start + offset
            if leader not in moving or places.get(name, 0) >= places.get(leader, 0):
                continue
            if not _FACTORS[0] <= abs(factor) <= _FACTORS[1] or abs(offset) >= UNBOUNDED:
                continue
            limit, led = _require(joint, "limit"), joints[leader]
            effort = limit_value(_require(led, "limit"), "effort") / abs(factor)
        except Refusal:  # it is told where the joint is settled
            continue
        _drop(joint, "mimic")
        limit.set("effort", repr(effort))
        if (rotor := led.find("dynamics")) is not None:
            _drop(joint, "dynamics")
            inertia = float(rotor.get("armature", "0")) / factor**2
            etree.SubElement(joint, "dynamics", damping="0", armature=repr(inertia))
        told = {"multiplier": repr(1.0 / factor), "offset": repr((0.0 - offset) / factor)}
        etree.SubElement(led, "mimic", joint=name, **told)
        moving = moving - {leader} | {name}
        text = f"it leads '{shortened(leader)}', which the file says it follows: it comes first in the tree"
        yield Finding("note", label(joint), text)


def coupling(follower: Element) -> tuple[str, float, float]:
    """Returns the leader, the multiplier and the offset, rad or m, of a joint that follows another one."""
    mimic = _require(follower, "mimic")
    factor, offset = (float(numbers(mimic, key, 1, (usual,))[0]) for key, usual in _COUPLING)
    return mimic.get("joint", ""), factor, offset


_COUPLING = (("multiplier", 1.0), ("offset", 0.0))
_FACTORS = 1e-3, 1e3  # a follower that moves less or more is held
_MOST_FOLLOWERS = 20
_LEAST_RANGE = 1e-3  # rad or m


def _places(root: Element) -> dict[str, int]:
    """Returns the index of each joint in Pinocchio's model. It depends on the tree of the joints only, so
    nothing else is read, which may not be valid yet."""
    bare = etree.fromstring(without_shapes(root))
    for joint in bare.iterfind("joint"):
        _drop(joint, "mimic", "dynamics", "calibration", "safety_controller")
    for limit in bare.iterfind("joint/limit"):
        limit.attrib.update({"velocity": "1", "effort": "1"})
    for link in bare.iterfind("link"):
        _drop(link, "inertial")
    names = pin.buildModelFromXML(etree.tostring(bare, encoding="unicode")).names
    return {name: place for place, name in enumerate(names)}


def _cannot_follow(joint: Element, leads: Element | None, places: dict[str, int], count: int) -> str:
    """Returns why the motion of a joint that follows another one, which may follow a third one, cannot be
    simulated, or "". The element `mimic` of the joint then names a joint with a coordinate of its own."""
    leader, factor, offset = coupling(joint)
    if leads is None or leads.get("type") == "fixed":
        return "its leader does not move"
    if leads.find("mimic") is not None:
        leader, first, start = coupling(leads)
        factor, offset = factor * first, factor * start + offset
    if not _FACTORS[0] <= abs(factor) <= _FACTORS[1] or abs(offset) >= UNBOUNDED:
        return "its factor or its offset is out of range"
    if places.get(joint.get("name", ""), 0) <= places.get(leader, len(places)):
        return "its leader comes after it in the tree"
    if count >= _MOST_FOLLOWERS:
        return f"only {_MOST_FOLLOWERS} joints can follow others"
    mimic = _require(joint, "mimic")
    mimic.set("joint", leader)
    mimic.set("multiplier", repr(factor))
    mimic.set("offset", repr(offset))
    return ""


def _keep_range(joint: Element, leader: Element) -> Iterator[Finding]:
    """Cuts the range of a leader so that a joint that follows it stays in its own range, and reports both;
    fixes the joint if no range is left."""
    name, factor, offset = coupling(joint)
    limit = _require(leader, "limit")
    given = _ends(limit)
    ends = (
        end if abs(end) < UNBOUNDED else math.copysign(math.inf, end)
        for end in _ends(_require(joint, "limit"))
    )
    first, last = sorted((end - offset) / factor for end in ends)
    low, high = max(given[0], first), min(given[1], last)
    if high - low < _LEAST_RANGE:
        yield freeze(joint, *_led(joint, name, leader, True, "its own range leaves its leader none"))
        return
    yield Finding("note", label(joint), f"it follows '{shortened(name)}': {factor:g} · q + {offset:g}")
    if max(low - given[0], given[1] - high) > 1e-9:
        limit.set("lower", repr(low))
        limit.set("upper", repr(high))
        text = f"its range is cut to [{low:.4g}, {high:.4g}], so that {label(joint)}, which follows it, stays"
        yield Finding("repaired", label(leader), f"{text} in its own")


def _led(joint: Element, leader: str, leads: Element | None, moves: bool, why_not: str) -> tuple[float, str]:
    """Returns the value of a joint that is held although it follows another one, rad or m, and the reason for
    the report."""
    _, factor, offset = coupling(joint)
    if leads is None or (leads.get("type") != "fixed" and leads.find("limit") is None):
        q = 0.0
    elif leads.get("type") == "fixed":
        q = float(leads.get(HELD, "0"))
    else:
        q = float(np.clip(resting(leads), *_ends(_require(leads, "limit"))))
    reason = f"it mimics '{shortened(leader)}'" + (", which does not exist" if leads is None else "")
    if moves:
        reason = (
            f"it should follow '{shortened(leader)}' with factor {factor:g}, which is not simulated "
            f"({why_not}): what it carries moves differently on the real robot"
        )
    elif q != 0.0:
        reason += f", which is held at {q:.4g}"
    return factor * q + offset, reason


def _leader(joint: Element) -> str:
    return _require(joint, "mimic").get("joint", "")


def _first_leader(follower: Element, joints: dict[str, Element]) -> str:
    """Returns the leader of a joint that follows another one; it is a joint that follows none."""
    seen: dict[str, None] = {}
    name = _leader(follower)
    while name in joints and name not in seen and joints[name].find("mimic") is not None:
        seen[name] = None
        name = _leader(joints[name])
    return name


def _to_freeze(root: Element, held: dict[str, tuple[float, str]]) -> dict[str, tuple[float, str]]:
    """Returns the joints that an arm controller does not move, as name → (value, reason)."""
    frozen = dict(held)
    joints, moving = named(root, "joint"), movable_joints(root)
    for joint in moving:
        name = joint.get("name", "")
        if _GRIPPER_JOINT.search(name) or _GRIPPER_LINK.search(end_of(joint, "child")):
            frozen.setdefault(name, (resting(joint), "by its name it belongs to a gripper"))
    carriers = parent_joints(root)
    loaded = {  # joints that carry an arm
        above.get("name", "")
        for joint in moving
        if joint.get("name") not in frozen
        for above in _ancestors(carriers, end_of(joint, "parent"))
    }
    for joint in followers(root):
        name, leader = joint.get("name", ""), _first_leader(joint, joints)
        pair = {name, leader}
        if leader in joints and not pair & loaded and not _same_chain(carriers, joint, joints[leader]):
            frozen.setdefault(
                leader, (resting(joints[leader]), f"'{name}' mimics it, so it drives a gripper")
            )
    # The robot may be a hand without an arm: if no other joints move, joints with gripper names stay movable.
    return dict(held) if {joint.get("name", "") for joint in moving} <= frozen.keys() else frozen


def _same_chain(carriers: dict[str, Element], one: Element, other: Element) -> bool:
    """Returns whether one of two joints carries the other."""
    pairs = ((one, other), (other, one))
    return any(first in _ancestors(carriers, end_of(second, "child")) for first, second in pairs)


def _ancestors(carriers: dict[str, Element], link: str) -> Iterator[Element]:
    """Yields the joints from a link down to the root, nearest first."""
    while link in carriers:
        yield carriers[link]
        link = end_of(carriers[link], "parent")


def _axis(joint: Element) -> Iterator[Finding]:
    axis = joint.find("axis")
    if axis is None:
        axis = etree.SubElement(joint, "axis", xyz="1 0 0")
        yield Finding("filled", label(joint), "no axis; the URDF default x was used")
    direction = numbers(axis, "xyz", 3, (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(direction))
    if length < 1e-6:
        raise Refusal(label(joint), "its axis has no length; give a direction such as '0 0 1'")
    if abs(length - 1.0) > 1e-6:
        yield Finding("repaired", label(joint), f"its axis had length {length:.4g} and was normalised")
    axis.set("xyz", _text(direction / length) if length != 1.0 else _text(direction))


def _without_range(root: Element) -> list[Element]:
    """Returns the joints whose lower and upper limits are 0 if these are most of the robot's joints, because
    then nobody filled them in. A single such joint is held at 0."""

    def is_zero(joint: Element) -> bool:
        limit = joint.find("limit")
        try:
            return limit is not None and limit_value(limit, "lower") == limit_value(limit, "upper") == 0.0
        except Refusal:
            return False

    every = (*movable_joints(root), *followers(root))
    joints = [joint for joint in every if joint.get("type") != "continuous"]
    zero = [joint for joint in joints if is_zero(joint)]
    return zero if 2 * len(zero) > len(joints) else []


def _limits(joint: Element, without_range: bool) -> Iterator[Finding]:
    limit = joint.find("limit")
    if limit is None:
        limit = etree.SubElement(joint, "limit")
    if joint.get("type") == "continuous":
        joint.set("type", "revolute")
        limit.set("lower", repr(-UNBOUNDED))
        limit.set("upper", repr(UNBOUNDED))
        yield Finding("note", label(joint), "continuous: its position is unbounded")
        return
    if limit.get("lower") is None and limit.get("upper") is None:
        limit.set("lower", repr(-UNBOUNDED))
        limit.set("upper", repr(UNBOUNDED))
        yield Finding("filled", label(joint), "no position limits; it is treated as unbounded")
        return
    # The URDF default of a missing bound is 0.
    lower, upper = limit_value(limit, "lower"), limit_value(limit, "upper")
    if lower == upper == 0.0 and (without_range or limit_value(limit, "velocity") <= 0.0):
        lower, upper = -UNBOUNDED, UNBOUNDED
        text = "its position limits are 0, a usual result of CAD exporters; it is treated as unbounded"
        yield Finding("filled", label(joint), text)
        limit.set("lower", repr(lower))
        limit.set("upper", repr(upper))
        return
    if lower > upper:
        lower, upper = upper, lower
        yield Finding(
            "repaired", label(joint), f"lower limit above upper; swapped to [{lower:.4g}, {upper:.4g}]"
        )
    bounded = [bound for bound in (lower, upper) if math.isfinite(bound)]
    if len(bounded) < 2 or max(map(abs, bounded)) >= UNBOUNDED:
        lower, upper = (float(np.clip(bound, -UNBOUNDED, UNBOUNDED)) for bound in (lower, upper))
        if lower == upper:
            lower, upper = -UNBOUNDED, UNBOUNDED
        yield Finding("note", label(joint), f"a limit of {UNBOUNDED:.0g} or more means that it is unbounded")
    elif joint.get("type") == "revolute" and max(map(abs, bounded)) > _TURNS:
        text = (
            f"its range [{lower:.4g}, {upper:.4g}] rad looks like degrees; a URDF has radians: divide by 57.3"
        )
        yield Finding("note", label(joint), text)
    limit.set("lower", repr(lower))
    limit.set("upper", repr(upper))


def _keep_armature(joint: Element) -> None:
    """Leaves of `dynamics` only the rotor inertia, kg·m² or kg, an attribute that other readers ignore. They
    need one of the others."""
    found = [numbers(each, "armature", 1, (0.0,))[0] for each in joint.findall("dynamics")]
    _drop(joint, "dynamics")
    if found and found[0] > 0.0:
        etree.SubElement(joint, "dynamics", damping="0", armature=repr(float(found[0])))


def _freeze_if_stuck(joint: Element) -> Iterator[Finding]:
    lower, upper = _ends(_require(joint, "limit"))
    if upper - lower < 1e-6:
        reason = "its limits allow no motion; set lower and upper to let it move"
        yield freeze(joint, 0.5 * (lower + upper), reason)


def _ends(limit: Element) -> tuple[float, float]:
    """Returns the ends of a joint's range, which `_limits` has written, rad or m."""
    return float(limit.get("lower", "0")), float(limit.get("upper", "0"))


def _require(joint: Element, tag: str) -> Element:
    found = joint.find(tag)
    if found is None:
        raise Refusal(label(joint), f"it has no <{tag}>")
    return found


def _drop(parent: Element, *tags: str) -> None:
    for tag in tags:
        for element in parent.findall(tag):
            parent.remove(element)


def _text(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def finite_bounds(lower: float, upper: float) -> bool:
    """Returns whether a pair of canonical limits belongs to a bounded joint."""
    return math.isfinite(lower) and math.isfinite(upper) and max(abs(lower), abs(upper)) < UNBOUNDED
