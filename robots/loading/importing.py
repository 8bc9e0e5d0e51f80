"""Builds a robot from a URDF document and estimates the data that the document lacks. It runs in the calling
process, without limits on time or memory."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import InputError
from robots.inertia import SLOW, mass_matrix, rotor_inertia, suggest_M_bar, tracking_bandwidth
from robots.joints import chain_length, joint_axis, joint_names, own_joints
from robots.loading.home import find_home, sensible_a_max
from robots.loading.imported import with_collision
from robots.meshes.files import has_meshes
from robots.plant import Plant
from robots.report import Finding, ImportReport
from robots.robot import Robot
from robots.urdf import UNBOUNDED, Canonical, canonicalise
from robots.urdf.read import Refusal, label, root_tag
from robots.urdf.structure import HOME, resting

_TRIAL = 5  # number of periods of 1 ms
_ROUNDING = 1e-4  # rad or m: what a file's rounded home may be outside the limits


@dataclass(frozen=True)
class Import:
    """Result of an import: the report, and the robot unless the description was refused."""

    report: ImportReport
    robot: Robot | None = None

    def used(self) -> Robot:
        """Returns the robot. Raises InputError with the first reason if the description cannot be used."""
        if self.robot is not None:
            return self.robot
        source, refused = self.report.source, [*self.report.of_kind("refused")]
        more = f" (and {len(refused) - 1} more; see `himpc-lab robots --check`)" if len(refused) > 1 else ""
        where = "" if refused[0].where == source else f"{refused[0].where}: "
        raise InputError(f"{source} cannot be used: {where}{refused[0].text}{more}.")


def import_robot(
    data: bytes,
    source: str,
    folder: Path | None = None,
    tip: str | None = None,
    within: Path | None = None,
    hold: tuple[str, ...] = (),
) -> Import:
    """Builds the robot of a URDF document and tests it in the plant for a few milliseconds.

    Args:
        data: the document.
        source: name of the document in messages.
        folder: folder to which mesh paths are relative; None: only meshes of installed packages are used.
        tip: default end-effector frame; None: the end of the longest chain.
        within: folder that must contain all other meshes; None: meshes may be anywhere.
        hold: patterns of joints that are held, see `load_robot`.

    Raises:
        InputError: the tip is not a frame of the robot, or a pattern fits no joint. All other problems
            are in the report.
    """
    noted: tuple[Finding, ...] = ()
    if root_tag(data) == "mujoco":
        from robots.mjcf.to_urdf import as_urdf

        try:
            data, noted = as_urdf(data, source, folder, within)
        except Refusal as refusal:
            return Import(ImportReport(source, (refusal.finding,)))
    canonical, report = canonicalise(data, source, folder, within, tip, hold)
    report = replace(report, findings=(*noted, *report.findings))
    if canonical is None:
        return Import(report)
    robot = _robot(replace(canonical, report=report))
    fault = "its mass matrix is singular; check its inertias" if robot is None else _trial(robot)
    if robot is None or fault is not None:
        refused = Finding("refused", source, fault or "")
        return Import(replace(report, findings=(*report.findings, refused)))
    if not has_meshes(robot.urdf_text):
        robot = with_collision(robot)
    return Import(robot.report, robot)


def bounds(model: pin.Model) -> tuple[np.ndarray, np.ndarray]:
    """Returns the position limits of a canonical model, ±inf for unbounded joints."""
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    return np.where(lower <= -UNBOUNDED, -np.inf, lower), np.where(upper >= UNBOUNDED, np.inf, upper)


def _robot(canonical: Canonical) -> Robot | None:
    """Returns the robot of a canonical description, or None if the mass matrix is singular."""
    model = canonical.model
    lower, upper = bounds(model)
    frames = {f.name: i for i, f in enumerate(model.frames) if f.type == pin.FrameType.BODY}
    given = _rotors_of(canonical)
    model.armature = np.where(given > 0.0, given, rotor_inertia(model, lower, upper))
    try:
        M_bar = suggest_M_bar(model, lower, upper)
    except np.linalg.LinAlgError:
        return None
    if not np.all(np.isfinite(M_bar) & (M_bar > 0.0)):
        return None
    home, told = _home_of(canonical, lower, upper)
    if home is None:
        home = find_home(model, frames[canonical.report.tip], lower, upper)
    strange = _strange_inertias(model, chain_length(model, frames[canonical.report.tip]))
    findings = (*canonical.report.findings, *told, *strange, *_assumed(model, given, home, M_bar))
    return Robot(
        name=canonical.name,
        model=model,
        joint_names=joint_names(model),
        tip=canonical.report.tip,
        home=home,
        q_lower=lower,
        q_upper=upper,
        v_limit=model.velocityLimit,
        tau_limit=model.effortLimit,
        a_max=sensible_a_max(model, lower, upper, model.effortLimit),
        M_bar=M_bar,
        urdf_text=canonical.text,
        report=replace(canonical.report, findings=findings),
    )


def _strange_inertias(model: pin.Model, length: float) -> Iterator[Finding]:
    """Yields a note for each body whose inertia, kg·m², cannot be that of its mass in an arm of this length,
    m: the radius of gyration is larger than the arm."""
    for joint in range(1, model.njoints):
        body = model.inertias[joint]
        radius = math.sqrt(float(np.linalg.eigvalsh(body.inertia)[-1]) / body.mass)
        if radius > length > 0.0:
            text = (
                f"the inertia of what it moves is as if its mass were {radius:.2g} m from its centre, and "
                f"the arm is {length:.2g} m long: check its unit (kg·m²)"
            )
            yield Finding("note", f"joint '{model.names[joint]}'", text)


def _home_of(
    canonical: Canonical, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray | None, tuple[Finding, ...]]:
    """Returns the posture (n,), rad or m, from which the file says that the robot starts, and a note; None if
    there is none, or if it is outside the limits."""
    joints = _joints_of(canonical)
    if any(joint.get(HOME) is None for joint in joints):
        return None, ()
    home = np.array([resting(joint) for joint in joints])
    for joint, at, low, high in zip(joints, home, lower, upper, strict=True):
        if not low - _ROUNDING <= at <= high + _ROUNDING:
            text = f"{label(joint)} would be at {at:.4g}, outside its range [{low:.4g}, {high:.4g}]"
            return None, (Finding("note", "home", f"that of the file is not used: {text}"),)
    note = Finding("note", "home", "the robot starts from the posture of its file")
    return np.clip(home, lower, upper), (note,)


def _joints_of(canonical: Canonical) -> list[Element]:
    """Returns the joints with a coordinate of their own, in the order of the model."""
    joints = {each.get("name"): each for each in etree.fromstring(canonical.text).iterfind("{*}joint")}
    return [joints[name] for name in joint_names(canonical.model)]


def _rotors_of(canonical: Canonical) -> np.ndarray:
    """Returns the rotor inertias, (n,) kg·m² or kg, that a canonical description gives; 0: none."""
    given = [joint.find("{*}dynamics") for joint in _joints_of(canonical)]
    return np.array([0.0 if each is None else float(each.get("armature", "0")) for each in given])


def _assumed(model: pin.Model, given: np.ndarray, home: np.ndarray, M_bar: np.ndarray) -> Iterator[Finding]:
    """Yields what was assumed about the rotors, and whether the robot will be slow all the same."""
    values = ", ".join(f"{value:g}" for value, own in zip(model.armature, given, strict=True) if own <= 0.0)
    if values:
        slides = any(joint_axis(model, joint)[0] for joint in own_joints(model))
        unit = "kg·m² (sliding joints: kg)" if slides else "kg·m²"
        text = f"their inertia is not described; {values} {unit} were assumed from what they move and from"
        text += " their torque and speed limits"
        yield Finding("filled", "rotors", f"{text}, plant.armature changes them")
    bandwidth = tracking_bandwidth(mass_matrix(model, model.createData(), home), M_bar, 1e-3)
    if bandwidth < SLOW:
        text = (
            f"M̄ has to be so small beside M that tasks settle with at most {bandwidth:g} 1/s: the arm is slow"
        )
        yield Finding("note", "control", text)


def _trial(robot: Robot) -> str | None:
    """Simulates the robot briefly. Returns the problem if a simulation is impossible; otherwise None."""
    try:
        plant = Plant(robot)
        for _ in range(_TRIAL):
            plant.step(plant.holding_torque(), 1e-3)
    except (ValueError, RuntimeError):
        return "MuJoCo cannot simulate it; check its inertias and origins"
    finite = all(np.isfinite(each).all() for each in (plant.q, plant.v, plant.mass_matrix(), robot.a_max))
    return None if finite and not plant.broken else "its motion is not finite; check its inertias and limits"
