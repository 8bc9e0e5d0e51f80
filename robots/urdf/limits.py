"""Speed and effort limits: missing values are estimated from the robot's own model and reported."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.inertia import sampled_loads
from robots.report import Finding
from robots.urdf.inertials import ASSUMED, lighten
from robots.urdf.joints import coupling, finite_bounds
from robots.urdf.read import Refusal, label, limit_value
from robots.urdf.structure import UNDERACTUATED, followers, movable_joints

_SPEED = {"revolute": np.pi, "prismatic": 0.5}  # rad/s, m/s: fast, but safe for an unknown arm
_LEAST = 1e-6  # rad/s, N·m: a smaller limit counts as missing, because it would allow no motion
_LEVER = 3.0  # effort limit divided by the largest gravity load
_FASTEST = 50.0  # rad/s: no arm's joint is faster, but a limit in degrees says so
_ACCELERATION = 10.0  # rad/s², m/s²: acceleration that the effort limit allows in addition to gravity
_HELPLESS = 0.5
"""The given effort limits contradict the masses if they cannot hold the robot in more than this share of its
postures. Data sheets reach 0.36 (Talos) and 0.45 (Alicia M); a PR2, whose arms are carried by springs that a
URDF cannot describe, has 0.83."""
_OF_CARRIER = 0.2
"""An estimated effort limit is at least this share of that of the joint that carries this one: a wrist that
only turns the hand carries no weight, but its motor is hardly smaller. The smallest shares in data sheets are
0.14 (Panda, joint 5), 0.19 (UR5, wrist) and 0.36 (LBR iiwa 14)."""


def fill_speeds(root: Element) -> Iterator[Finding]:
    """Fills missing, zero and negative velocity limits. Effort limits that are missing, zero or negative are
    set to 0. A joint that another one follows is so slow that its follower keeps its limit."""
    yield from _slowed_by_followers(root)
    for joint in movable_joints(root):
        limit = joint.find("limit")
        if limit is None:
            limit = etree.SubElement(joint, "limit")
        try:
            given = limit_value(limit, "velocity")
            if given < _LEAST or np.isinf(given):
                speed = float(_SPEED[joint.get("type", "")])
                limit.set("velocity", repr(speed))
                unit = "m/s" if joint.get("type") == "prismatic" else "rad/s"
                yield Finding("filled", label(joint), f"no velocity limit; {speed:.3g} {unit} was used")
            elif joint.get("type") != "prismatic" and given > _FASTEST:
                text = f"its velocity limit {given:.4g} rad/s looks like degrees; a URDF has radians"
                text += ": divide by 57.3"
                yield Finding("note", label(joint), text)
            effort = limit_value(limit, "effort")
            if effort < _LEAST or np.isinf(effort):
                limit.set("effort", "0")
        except Refusal as refusal:
            yield refusal.finding


def _slowed_by_followers(root: Element) -> Iterator[Finding]:
    leaders = {joint.get("name", ""): joint for joint in movable_joints(root)}
    for follower in followers(root):
        leader, factor, _ = coupling(follower)
        limit, own_limit = leaders[leader].find("limit"), follower.find("limit")
        if limit is None or own_limit is None:
            continue
        try:
            given, own = limit_value(limit, "velocity"), limit_value(own_limit, "velocity")
        except Refusal as refusal:
            yield refusal.finding
            continue
        given = given if given >= _LEAST else float(_SPEED[leaders[leader].get("type", "")])
        speed = own / abs(factor) if own >= _LEAST else np.inf
        own_limit.set("velocity", repr(own) if _LEAST <= own < np.inf else "0")
        own_limit.set("effort", "0")
        if speed < given:
            limit.set("velocity", repr(speed))
            text = f"its velocity limit is {speed:.3g}, as {label(follower)} follows it"
            yield Finding("repaired", label(leaders[leader]), text)


def fit_masses(root: Element, model: pin.Model) -> Iterator[Finding]:
    """Makes the masses that the file does not give lighter if its effort limits could not move them: shapes
    are often drawn thicker than the robot, and a motor carries its arm."""
    if root.find(f"link/inertial[@{ASSUMED}]") is None:
        return
    gravity = _loads(model)[0].max(axis=0)
    places = {joint: _coordinate(model, joint) for joint in movable_joints(root)}
    loads = [gravity[place] / effort for joint, place in places.items() if (effort := _effort(joint)) > 0.0]
    share = 1.0 / (_LEVER * float(max(loads, default=0.0)) + 1e-12)
    if share < 1.0:
        lighten(root, share)
        text = f"masses that were put there are multiplied by {share:.2g}: the effort limits carry no more"
        yield Finding("filled", "masses", text)


def fill_efforts(root: Element, model: pin.Model) -> Iterator[Finding]:
    """Fills the effort limits that are 0, in the tree and in its model: three times the largest gravity load
    plus an effort for acceleration. If the given limits cannot hold the robot in most postures, those that
    are too small are filled as if they were missing, unless the robot is underactuated on purpose. Yields a
    note for each other given limit that cannot hold the robot everywhere.

    τ_i = 3 max|g_i(q)| + 10 rad/s² · max M_ii(q) over sampled configurations, and at least a fifth of the
    limit of the joint of the same kind that carries joint i, to two digits.
    """
    gravity, inertia = _loads(model)
    given = np.zeros(model.nv)
    for joint in movable_joints(root):
        given[_coordinate(model, joint)] = _effort(joint)
    over = (given > 0.0) & (gravity > given)
    helpless = over.any(axis=1).mean() > _HELPLESS and UNDERACTUATED not in root.attrib
    gravity = gravity.max(axis=0)
    limits = model.effortLimit.copy()
    kind: dict[int, str | None] = {}
    for joint in sorted(movable_joints(root), key=lambda each: _coordinate(model, each)):
        place = _coordinate(model, joint)
        index = model.getJointId(joint.get("name", ""))
        kind[index], carrier = joint.get("type"), int(model.parents[index])
        unit = "N" if joint.get("type") == "prismatic" else "N·m"
        weak = 0.0 < given[place] < gravity[place]
        too_small = f"its effort limit is {given[place]:.3g} {unit}; holding the robot takes up to"
        too_small += f" {gravity[place]:.2g} {unit}"
        if given[place] > 0.0 and not (weak and helpless):
            if weak:
                yield Finding("note", label(joint), too_small)
            continue
        own = max(_LEVER * gravity[place] + _ACCELERATION * inertia[place], 1e-3)
        alike = kind.get(carrier) == joint.get("type")
        least = _OF_CARRIER * limits[model.idx_vs[carrier]] if alike else 0.0
        effort = float(f"{max(own, least):.1e}")
        limits[place] = effort
        limit = joint.find("limit")
        if limit is not None:
            limit.set("effort", repr(effort))
        source = "the weight it carries" if own >= least else "the joint that carries it"
        kind_of, why = ("repaired", too_small) if weak else ("filled", "no effort limit")
        text = f"{why}; {effort:g} {unit} was estimated from {source}"
        yield Finding(kind_of, label(joint), text)
    model.effortLimit = limits


def _coordinate(model: pin.Model, joint: Element) -> int:
    return int(model.idx_vs[model.getJointId(joint.get("name", ""))])


def _effort(joint: Element) -> float:
    limit = joint.find("limit")
    return 0.0 if limit is None else float(limit.get("effort", "0"))


def _loads(model: pin.Model) -> tuple[np.ndarray, np.ndarray]:
    """Returns `sampled_loads` inside the limits of a canonical model."""
    pairs = zip(model.lowerPositionLimit, model.upperPositionLimit, strict=True)
    bounded = np.array([finite_bounds(low, high) for low, high in pairs])
    lower = np.where(bounded, model.lowerPositionLimit, -np.inf)
    upper = np.where(bounded, model.upperPositionLimit, np.inf)
    return sampled_loads(model, lower, upper)
