"""Speed and effort limits: missing values are estimated from the robot's own model and reported."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.inertia import mass_matrix, sample_configurations
from robots.report import Finding
from robots.urdf.joints import finite_bounds
from robots.urdf.read import Refusal, label, numbers
from robots.urdf.structure import movable_joints

_SPEED = {"revolute": np.pi, "prismatic": 0.5}  # rad/s, m/s: fast, but safe for an unknown arm
_LEAST = 1e-6  # rad/s, N·m: a smaller limit counts as missing, because it would allow no motion
_LEVER = 3.0  # effort limit divided by the largest gravity load
_ACCELERATION = 10.0  # rad/s², m/s²: acceleration that the effort limit allows in addition to gravity


def fill_speeds(root: Element) -> Iterator[Finding]:
    """Fills missing, zero and negative velocity limits. Effort limits that are missing, zero or negative are
    set to 0."""
    for joint in movable_joints(root):
        limit = joint.find("limit")
        if limit is None:
            limit = etree.SubElement(joint, "limit")
        try:
            if float(numbers(limit, "velocity", 1, (0.0,))[0]) < _LEAST:
                speed = float(_SPEED[joint.get("type", "")])
                limit.set("velocity", repr(speed))
                unit = "m/s" if joint.get("type") == "prismatic" else "rad/s"
                yield Finding("filled", label(joint), f"no velocity limit; {speed:.3g} {unit} was used")
            if float(numbers(limit, "effort", 1, (0.0,))[0]) < _LEAST:
                limit.set("effort", "0")
        except Refusal as refusal:
            yield refusal.finding


def fill_efforts(root: Element, model: pin.Model) -> Iterator[Finding]:
    """Fills the effort limits that are 0, in the tree and in its model: three times the largest gravity load
    plus an effort for acceleration.

    τ_i = 3 max|g_i(q)| + 10 rad/s² · max M_ii(q) over sampled configurations, to two digits.
    """
    joints = {joint.get("name", ""): joint for joint in movable_joints(root)}
    missing = [name for name, joint in joints.items() if _effort(joint) <= 0.0]
    if not missing:
        return
    needed = _needed_effort(model)
    limits = model.effortLimit.copy()
    for name in missing:
        place = model.getJointId(name) - 1
        effort = float(f"{needed[place]:.1e}")
        limits[place] = effort
        limit = joints[name].find("limit")
        if limit is not None:
            limit.set("effort", repr(effort))
        unit = "N" if joints[name].get("type") == "prismatic" else "N·m"
        text = f"no effort limit; {effort:g} {unit} was estimated from the weight it carries"
        yield Finding("filled", label(joints[name]), text)
    model.effortLimit = limits


def _effort(joint: Element) -> float:
    limit = joint.find("limit")
    return 0.0 if limit is None else float(limit.get("effort", "0"))


def _needed_effort(model: pin.Model) -> np.ndarray:
    data = model.createData()
    pairs = zip(model.lowerPositionLimit, model.upperPositionLimit, strict=True)
    bounded = np.array([finite_bounds(low, high) for low, high in pairs])
    lower = np.where(bounded, model.lowerPositionLimit, -np.inf)
    upper = np.where(bounded, model.upperPositionLimit, np.inf)
    samples = sample_configurations(lower, upper, 64)
    gravity = np.array([pin.computeGeneralizedGravity(model, data, q) for q in samples])
    inertia = np.array([np.diag(mass_matrix(model, data, q)) for q in samples])
    needed = _LEVER * np.abs(gravity).max(axis=0) + _ACCELERATION * inertia.max(axis=0)
    return np.maximum(needed, 1e-3)
