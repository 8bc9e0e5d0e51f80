"""Writes the robot of a compiled MuJoCo model as a URDF, which the import then treats as any other."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
from lxml import etree
from lxml.etree import _Element as Element

from robots.errors import shortened
from robots.mjcf.compile import Compiled, compiled_mjcf
from robots.report import Finding
from robots.urdf.read import Refusal
from robots.urdf.structure import HOME, UNDERACTUATED

_TIP = re.compile(r"attach|grip|grasp|tcp|tool|pinch|flange|(^|_)(tip|ee|eef)(_|$)|end_?eff", re.IGNORECASE)
_CUBE = (np.pi / 6.0) ** (1.0 / 3.0)
"""Edge of a cube, divided by the diameter of the ball with the same volume."""
_NO_COLOUR = (0.5, 0.5, 0.5, 1.0)
_LEAST_MASS, _LEAST_INERTIA = 1e-6, 1e-9  # kg, kg·m²
_FREE, _BALL, _SLIDE, _HINGE = (
    int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("FREE", "BALL", "SLIDE", "HINGE")
)


def as_urdf(
    data: bytes, source: str, folder: Path | None = None, within: Path | None = None
) -> tuple[bytes, tuple[Finding, ...]]:
    """Returns a URDF with the bodies, joints, inertias, limits, rotor inertias, shapes and home of an MJCF
    document, and what was left out.

    A link has the frame of its body, and a joint has MuJoCo's value. The arguments are those of
    `canonicalise`. Raises Refusal for a model that cannot be compiled, and for ball joints.
    """
    found = compiled_mjcf(data, source, folder, within)
    model = found.model
    moved = _moved(model)
    kept = [body for body in range(model.nbody) if not _is_object(model, body, moved)]
    root = etree.Element("robot", name=found.name.strip() or "robot")
    for body in kept:
        _add_link(root, model, body, found.meshes)
    followed = {k: told for k, told in _followed(model) if model.jnt_bodyid[told[0]] in kept}
    own = {joint for body in kept for joint in _joints(model, body) if model.jnt_type[joint] != _FREE}
    if moved and own - moved - followed.keys():
        root.set(UNDERACTUATED, "true")
    home, why_not = _home(found)
    for body in kept[1:]:
        _add_joints(root, model, body, followed, home)
    links = {link.get("name") for link in root.iter("link")}
    for site in range(model.nsite):
        name, body = model.site(site).name, int(model.site_bodyid[site])
        if body in kept and _TIP.search(name) and name not in links:
            etree.SubElement(root, "link", name=name)
            at = _placement(model.site_pos[site], model.site_quat[site])
            _joint(root, f"site {name}", _name(model, body), name, at, "fixed")
    noted = (Finding("note", "home", f"{why_not}: another home was chosen"),) if why_not else ()
    return etree.tostring(root), (*found.findings, *noted, *_left_out(found, source, kept, followed))


def _name(model: mujoco.MjModel, body: int) -> str:
    return model.body(body).name or f"body{body}"


def _label(model: mujoco.MjModel, joint: int) -> str:
    return model.joint(joint).name or f"joint{joint}"


def _placement(pos: np.ndarray, quat: np.ndarray) -> pin.SE3:
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, quat)
    return pin.SE3(R.reshape(3, 3), np.array(pos))


def _joints(model: mujoco.MjModel, body: int) -> range:
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body]))


def _is_object(model: mujoco.MjModel, body: int, moved: set[int]) -> bool:
    """Whether a body is part of a thing beside the robot: it floats, or follows a mocap target, and none of
    its parts has a joint of its own; or it has joints, and actuators move only those of other things."""
    root = int(model.body_rootid[body])
    own = [j for j in range(model.njnt) if model.body_rootid[model.jnt_bodyid[j]] == root and body]
    floats = any(model.jnt_type[j] == _FREE for j in own) or model.body_mocapid[root] >= 0
    passive = bool(own) and bool(moved) and moved.isdisjoint(own)
    return passive or (floats and all(model.jnt_type[j] == _FREE for j in own))


def _add_link(root: Element, model: mujoco.MjModel, body: int, meshes: dict[str, Path]) -> None:
    link = etree.SubElement(root, "link", name=_name(model, body))
    if model.body_mass[body] > 0.0:
        at = _placement(model.body_ipos[body], model.body_iquat[body])
        _inertial(link, at, float(model.body_mass[body]), model.body_inertia[body])
    own = range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
    touching = [k for k in own if model.geom_contype[k] or model.geom_conaffinity[k]]
    for geom in own:
        tags = ("collision",) if geom in touching else ("visual",)
        if len(touching) == len(own):
            tags = ("visual", "collision")  # there is no geometry for drawing alone
        for tag in tags:
            material, rgba = int(model.geom_matid[geom]), model.geom_rgba[geom]
            if material >= 0 and np.allclose(rgba, _NO_COLOUR):
                rgba = model.mat_rgba[material]
            for at, solid in _solids(model, geom, meshes) if tag == "collision" or rgba[3] > 0.0 else ():
                shape = etree.SubElement(link, tag)
                _origin(shape, at)
                etree.SubElement(shape, "geometry").append(solid)
                if tag == "visual":
                    etree.SubElement(etree.SubElement(shape, "material", name=""), "color", rgba=_text(rgba))


def _solids(model: mujoco.MjModel, geom: int, meshes: dict[str, Path]) -> Iterator[tuple[pin.SE3, Element]]:
    """Yields the placements in the body's frame and the URDF shapes that a geometry consists of; none for a
    plane and for a mesh without a file. An ellipsoid becomes a box of the same volume."""
    at = _placement(model.geom_pos[geom], model.geom_quat[geom])
    size = model.geom_size[geom]
    match mujoco.mjtGeom(model.geom_type[geom]):
        case mujoco.mjtGeom.mjGEOM_BOX:
            yield at, etree.Element("box", size=_text(2.0 * size))
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            yield at, etree.Element("box", size=_text(2.0 * _CUBE * size))
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            yield at, etree.Element("sphere", radius=_text(size[0]))
        case mujoco.mjtGeom.mjGEOM_CYLINDER | mujoco.mjtGeom.mjGEOM_CAPSULE as kind:
            yield at, etree.Element("cylinder", radius=_text(size[0]), length=_text(2.0 * size[1]))
            for end in (size[1], -size[1]) if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else ():
                ball = at * pin.SE3(np.eye(3), np.array([0.0, 0.0, end]))
                yield ball, etree.Element("sphere", radius=_text(size[0]))
        case mujoco.mjtGeom.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            path = meshes.get(model.mesh(mesh).name)
            if path is not None:
                # The compiler moved the vertices to their centre and turned them to their principal axes.
                moved = _placement(model.mesh_pos[mesh], model.mesh_quat[mesh])
                scale = _text(model.mesh_scale[mesh])
                yield at * moved.inverse(), etree.Element("mesh", filename=str(path), scale=scale)


def _home(found: Compiled) -> tuple[np.ndarray | None, str]:
    """Returns the posture `qpos` from which the robot starts: the key posture `home`, or the only one. If
    there are key postures and none is used, a sentence says why."""
    chosen = [each for each in found.keys if each[0] == "home"] or [*found.keys]
    if not chosen:
        return None, ""
    name, text = chosen[0]
    if len(chosen) > 1 and name != "home":
        return None, f"none of its {len(chosen)} key postures is called 'home'"
    try:
        values = np.array([float(word) for word in text.split()]) if text.strip() else found.model.qpos0
    except ValueError:
        values = np.zeros(0)
    if values.shape != (found.model.nq,) or not np.isfinite(values).all():
        return None, f"its key posture '{shortened(name)}' has not {found.model.nq} finite numbers"
    return values, ""


def _add_joints(
    root: Element,
    model: mujoco.MjModel,
    body: int,
    followed: dict[int, tuple[int, float, float]],
    home: np.ndarray | None,
) -> None:
    """Adds the joints between a body and its parent. In MuJoCo a body may have several, each with an anchor
    of its own; a URDF needs a link after each, which gets the least mass that a simulator can use."""
    name, parent = _name(model, body), _name(model, int(model.body_parentid[body]))
    at = _placement(model.body_pos[body], model.body_quat[body])
    own = [k for k in _joints(model, body) if model.jnt_type[k] != _FREE]
    for k in own:
        axis, label = np.array(model.jnt_axis[k]), _label(model, k)
        if model.jnt_type[k] == _BALL:
            text = "a ball joint has three axes; replace it by three hinges, or by a fixed body"
            raise Refusal(f"joint '{shortened(label)}'", text)
        slides = model.jnt_type[k] == _SLIDE
        anchor = pin.SE3(np.eye(3), np.array(model.jnt_pos[k]))
        start = -float(model.qpos0[model.jnt_qposadr[k]]) * axis
        motion = pin.SE3(np.eye(3), start) if slides else pin.SE3(pin.exp3(start), np.zeros(3))
        child = name if k == own[-1] and not model.jnt_pos[k].any() else f"{name} after {label}"
        if child != name:
            link = etree.SubElement(root, "link", name=child)
            if k != own[-1]:
                _inertial(link, pin.SE3.Identity(), _LEAST_MASS, _LEAST_INERTIA * np.ones(3))
        joint = _joint(
            root, label, parent, child, at * anchor * motion, "prismatic" if slides else "revolute"
        )
        if home is not None:
            joint.set(HOME, _text(home[model.jnt_qposadr[k]]))
        etree.SubElement(joint, "axis", xyz=_text(axis))
        limit = etree.SubElement(joint, "limit", velocity="0", effort=_text(_effort(model, k)))
        if model.jnt_limited[k]:
            lower, upper = map(_text, model.jnt_range[k])
            limit.set("lower", lower)
            limit.set("upper", upper)
        elif not slides:
            joint.set("type", "continuous")
        rotor = float(model.dof_armature[model.jnt_dofadr[k]])
        etree.SubElement(joint, "dynamics", armature=_text(rotor))
        if k in followed:
            leader, factor, offset = followed[k]
            told = {"multiplier": _text(factor), "offset": _text(offset)}
            etree.SubElement(joint, "mimic", joint=_label(model, leader), **told)
        parent, at = child, anchor.inverse()
    if parent != name:
        _joint(root, f"{name} fixed", parent, name, at, "fixed")


def _joint(root: Element, name: str, parent: str, child: str, at: pin.SE3, kind: str) -> Element:
    joint = etree.SubElement(root, "joint", name=name, type=kind)
    etree.SubElement(joint, "parent", link=parent)
    etree.SubElement(joint, "child", link=child)
    _origin(joint, at)
    return joint


def _inertial(link: Element, at: pin.SE3, mass: float, moments: np.ndarray) -> None:
    inertial = etree.SubElement(link, "inertial")
    _origin(inertial, at)
    etree.SubElement(inertial, "mass", value=_text(mass))
    x, y, z = map(_text, moments)
    etree.SubElement(inertial, "inertia", ixx=x, iyy=y, izz=z, ixy="0", ixz="0", iyz="0")


def _effort(model: mujoco.MjModel, joint: int) -> float:
    """Returns the largest force or torque of a joint's actuators, N or N·m; 0 if nothing limits it."""
    total = 0.0
    on_joints = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    for k in range(model.nu):
        if model.actuator_trntype[k] not in on_joints or model.actuator_trnid[k, 0] != joint:
            continue
        is_motor = (
            model.actuator_gaintype[k] == mujoco.mjtGain.mjGAIN_FIXED
            and model.actuator_biastype[k] == mujoco.mjtBias.mjBIAS_NONE
        )
        if model.actuator_forcelimited[k]:
            most = np.abs(model.actuator_forcerange[k]).max()
        elif model.actuator_ctrllimited[k] and is_motor:
            most = np.abs(model.actuator_ctrlrange[k]).max() * abs(model.actuator_gainprm[k, 0])
        else:
            most = np.inf
        total += float(most * abs(model.actuator_gear[k, 0]))
    if model.jnt_actfrclimited[joint]:
        most = float(np.abs(model.jnt_actfrcrange[joint]).max())
        total = min(total or np.inf, most)
    return total if np.isfinite(total) else 0.0


def _moved(model: mujoco.MjModel) -> set[int]:
    """Returns the joints that actuators move, directly or by a tendon."""
    on_joints = model.actuator_trntype <= int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    by_tendon = model.wrap_type == int(mujoco.mjtWrap.mjWRAP_JOINT)
    return {*model.actuator_trnid[on_joints, 0].tolist(), *model.wrap_objid[by_tendon].tolist()}


def _followed(model: mujoco.MjModel) -> Iterator[tuple[int, tuple[int, float, float]]]:
    """Yields each joint that an equality constraint makes a linear function of another joint, with this
    joint, the factor and the offset."""
    for k in range(model.neq):
        one, other = int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
        is_joint = model.eq_type[k] == mujoco.mjtEq.mjEQ_JOINT and other >= 0 and model.eq_active0[k]
        if is_joint and not model.eq_data[k, 2:5].any():
            start = model.qpos0[[model.jnt_qposadr[one], model.jnt_qposadr[other]]]
            offset, factor = map(float, model.eq_data[k, :2])
            yield one, (other, factor, offset + float(start[0] - factor * start[1]))


def _left_out(
    found: Compiled, source: str, kept: list[int], followed: dict[int, tuple[int, float, float]]
) -> Iterator[Finding]:
    model = found.model
    for body in kept:
        if any(model.jnt_type[j] == _FREE for j in _joints(model, body)):
            text = "its free joint was made fixed: only fixed bases can be controlled"
            yield Finding("fixed", f"body '{shortened(_name(model, body))}'", text)
    moving = [j for j in range(model.njnt) if model.jnt_type[j] in (_HINGE, _SLIDE)]
    dofs = model.jnt_dofadr[moving]
    elsewhere = model.actuator_trntype > int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    damped = model.dof_damping[dofs] > 0.0
    counts = Counter(
        {
            "parts of things that stand beside the robot": model.nbody - len(kept),
            "meshes without a file": model.nmesh - len(found.meshes),
            "equality constraints": model.neq - len(followed),
            "tendons": model.ntendon,
            "actuators of tendons and sites": int(elsewhere.sum()),
            "bodies without weight (gravcomp)": int((model.body_gravcomp[kept] != 0.0).sum()),
            "joints with friction, damping or a spring (plant.friction and plant.damping set them)": int(
                ((model.dof_frictionloss[dofs] > 0.0) | damped | (model.jnt_stiffness[moving] != 0.0)).sum()
            ),
        }
    )
    if not model.opt.gravity.any():
        text = "the file has none; here it acts unless plant.gravity=false, and motors may be too weak"
        yield Finding("note", "gravity", text)
    listed = ", ".join(f"{count} {what}" for what, count in counts.items() if count > 0)
    if listed:
        yield Finding("note", source, f"of this MuJoCo model, these were left out: {listed}")


def _origin(element: Element, at: pin.SE3) -> None:
    rpy = pin.rpy.matrixToRpy(at.rotation)
    etree.SubElement(element, "origin", xyz=_text(at.translation), rpy=_text(rpy))


def _text(values: np.ndarray | float) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))
