"""MuJoCo's model of a robot and of the objects around it, also as a file for MuJoCo's C library."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin

from robots.collision import base_joint
from robots.errors import InputError
from robots.geometry import Excluded, Solid
from robots.joints import joint_axis, joints_at_zero, motions, own_joints
from robots.robot import Robot
from robots.settings import PlantSettings
from robots.truth import inertial, pose, true_model
from robots.world import Ball, Box, Floor, Post, Thing, World

# MuJoCo models friction as a spring-damper. With the default parameters, a light joint that should stick
# moves at tenths of rad/s. The parameters below are the stiffest ones that RK4 integrates without
# oscillations. They reduce this motion by a factor of ten thousand.
_STICTION_SOLREF = (0.002, 1.0)
_STICTION_SOLIMP = (0.9999, 0.9999, 0.001, 0.5, 2.0)
CONTACT_SOLREF = (0.004, 1.0)
"""Time constant (s) and damping ratio of a contact: see `benchmarks/contacts.py` of commit 0da97aa1."""
CONTACT_SOLIMP = (0.95, 0.99, 0.001, 0.5, 2.0)
_STOP_SOLREF = (0.004, 1.0)
_SLIDING = 0.5
"""Coefficient of sliding friction between two links."""
BASE = "base"
"""Name of the body with the solids that do not move."""


def compiled(
    robot: Robot,
    settings: PlantSettings,
    world: World = (),
    also: tuple[Excluded, ...] = (),
    margin: float = 0.0,
) -> mujoco.MjModel:
    """Returns MuJoCo's model. Body i carries joint i of Pinocchio's tree, and site k is frame k of this tree.
    A joint that follows another one is held to it by an equality constraint; its position counts from q = 0.

    With contacts, geometry k is solid k of the robot. The robot's bodies are followed by one body for all
    solids that are fixed to the world, and by one body for each object of the world. The joints of free
    objects follow the robot's joints.

    Args:
        robot, settings, world: the modelled robot, plant settings and world; the world is used with contacts
            only.
        also: further pairs of bodies whose contact is left out, in addition to the robot's own list.
        margin: m, margin of each solid; two solids count as touching if they are nearer than the sum of their
            margins.

    Raises InputError for a per-joint list of the wrong length, and for free objects with a changed diagonal.
    """
    truth = true_model(robot, settings)
    friction, damping = settings.per_joint("friction", robot.n), settings.per_joint("damping", robot.n)
    altered = bool((settings.per_joint("diagonal_scale", robot.n) != 1.0).any())
    spec = mujoco.MjSpec()
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.compiler.degree = False
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.gravity = truth.gravity.linear
    # By default MuJoCo restarts a diverging simulation without a message; here the divergence must be
    # visible.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if not settings.contacts:
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    bodies, placements = [spec.worldbody], joints_at_zero(truth)
    own, (column, factor) = own_joints(truth), motions(truth)
    for joint in range(1, truth.njoints):
        body = bodies[truth.parents[joint]].add_body(name=f"body{joint}", **pose(placements[joint]))
        bodies.append(body)
        body.mass, body.ipos, body.fullinertia = inertial(truth.inertias[joint])
        body.explicitinertial = True
        prismatic, axis = joint_axis(truth, joint)
        made = body.add_joint(
            name=f"joint{joint}",
            type=mujoco.mjtJoint.mjJNT_SLIDE if prismatic else mujoco.mjtJoint.mjJNT_HINGE,
            axis=axis,
            limited=mujoco.mjtLimited.mjLIMITED_FALSE,
        )
        at = int(column[joint])
        if joint not in own:
            _follow(spec, made.name, f"joint{own[at]}", factor[joint])
            continue
        made.armature, made.frictionloss = truth.armature[at], friction[at]
        made.damping = [damping[at], 0.0, 0.0]
        made.solref_friction, made.solimp_friction = _STICTION_SOLREF, _STICTION_SOLIMP
        if settings.joint_stops:
            _stop(made, robot.q_lower[at], robot.q_upper[at])
        spec.add_actuator(
            name=f"motor{joint}", target=f"joint{joint}", trntype=mujoco.mjtTrn.mjTRN_JOINT
        ).set_to_motor()
    for index, frame in enumerate(truth.frames):
        if frame.type == pin.FrameType.BODY:
            bodies[frame.parentJoint].add_site(name=f"frame{index}", **pose(frame.placement))
    if settings.contacts:
        _add_solids(spec, robot, bodies, margin)
        _add_world(spec, robot, world, altered)
        for pair in (*robot.collision.excluded, *also):
            spec.add_exclude(bodyname1=_body(pair.first), bodyname2=_body(pair.second))
    model = spec.compile()
    order = [model.joint(i).name for i in range(truth.njoints - 1)]
    if order != [f"joint{i}" for i in range(1, truth.njoints)]:
        raise RuntimeError(f"MuJoCo reordered the joints of '{robot.name}': {order}")
    geoms = [model.geom(i).name for i in range(model.ngeom)]
    wanted = [f"solid{i}" for i in range(len(robot.collision.solids))] + [
        f"shape{i}" for i in range(len(world))
    ]
    if settings.contacts and geoms != wanted:
        raise RuntimeError(f"MuJoCo reordered the shapes of '{robot.name}': {geoms}")
    return model


def _body(joint: int) -> str:
    return f"body{joint}" if joint else BASE


def _follow(spec: mujoco.MjSpec, follower: str, leader: str, factor: float) -> None:
    """Holds a joint at factor · q of its leader."""
    made = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=follower, name2=leader)
    made.data[:2] = 0.0, factor
    made.solref, made.solimp = _STICTION_SOLREF, _STICTION_SOLIMP


def _stop(joint: mujoco.MjsJoint, lower: float, upper: float) -> None:
    """Sets the limits of a joint that has at least one limit. In MuJoCo a joint has either two limits or no
    limits."""
    if np.isfinite(lower) or np.isfinite(upper):
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.range = (max(lower, -_FAR), min(upper, _FAR))
        joint.solref_limit, joint.solimp_limit = _STOP_SOLREF, CONTACT_SOLIMP


_FAR = 1e6  # rad or m


def _add_solids(spec: mujoco.MjSpec, robot: Robot, bodies: list[mujoco.MjsBody], margin: float) -> None:
    base = spec.worldbody.add_body(name=BASE)
    for index, solid in enumerate(robot.collision.solids):
        kind = _TYPES[solid.kind]
        body = bodies[solid.joint] if solid.joint else base
        geom = body.add_geom(name=f"solid{index}", type=kind, margin=margin, friction=_friction(_SLIDING))
        geom.solref, geom.solimp = CONTACT_SOLREF, CONTACT_SOLIMP
        if solid.kind == "hull":
            mesh = spec.add_mesh(name=f"hull{index}", uservert=np.ravel(solid.points).tolist())
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
            geom.meshname = mesh.name
        else:
            geom.size[: len(solid.size)] = solid.size
            geom.pos, geom.quat = solid.position, solid.quaternion


_TYPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "hull": mujoco.mjtGeom.mjGEOM_MESH,
}


def _friction(sliding: float) -> tuple[float, float, float]:
    """Returns the coefficients of sliding, torsional (m) and rolling (m) friction. The last two are MuJoCo's
    defaults."""
    return sliding, 0.005, 0.0001


def _add_world(spec: mujoco.MjSpec, robot: Robot, world: World, altered: bool) -> None:
    if altered and any(thing.free for thing in world):
        raise InputError(
            "plant.diagonal_scale and plant.contacts cannot be combined in a scene with free objects: "
            "set one of them to its default, 1 or false."
        )
    standing = base_joint(robot)
    for index, thing in enumerate(world):
        kind, size = _shape(thing)
        body = spec.worldbody.add_body(name=f"object{index}", pos=thing.pose[:3], quat=thing.pose[3:])
        if thing.mass_kg is not None:
            body.add_freejoint(name=f"free{index}")
            body.mass, body.inertia = thing.mass_kg, thing.mass_kg * np.array(_gyration(thing))
            body.ipos, body.iquat, body.explicitinertial = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), True
        geom = body.add_geom(name=f"shape{index}", type=kind, friction=_friction(thing.friction), priority=1)
        geom.size[:], geom.solref, geom.solimp = size, CONTACT_SOLREF, CONTACT_SOLIMP
        if isinstance(thing.shape, Floor) and standing:
            # A mobile base stands on the floor; its wheels are not simulated.
            for joint in range(standing + 1):
                spec.add_exclude(bodyname1=_body(joint), bodyname2=body.name)


def _shape(thing: Thing) -> tuple[mujoco.mjtGeom, tuple[float, ...]]:
    """Returns the type and the size of an object's geometry in MuJoCo."""
    match thing.shape:
        case Ball(_, _, radius):
            return mujoco.mjtGeom.mjGEOM_SPHERE, (radius, 0.0, 0.0)
        case Box(_, _, (x, y, z)):
            return mujoco.mjtGeom.mjGEOM_BOX, (0.5 * x, 0.5 * y, 0.5 * z)
        case Post(_, _, height, radius):
            return mujoco.mjtGeom.mjGEOM_CYLINDER, (radius, 0.5 * height, 0.0)
        case Floor():
            return mujoco.mjtGeom.mjGEOM_PLANE, (0.0, 0.0, 1.0)


def _gyration(thing: Thing) -> tuple[float, float, float]:
    """Returns the squares of the radii of gyration of a homogeneous body, m²."""
    match thing.shape:
        case Ball(_, _, radius):
            same = 0.4 * radius**2
            return same, same, same
        case Box(_, _, (x, y, z)):
            return (y**2 + z**2) / 12, (x**2 + z**2) / 12, (x**2 + y**2) / 12
        case Post(_, _, height, radius):
            across = (3 * radius**2 + height**2) / 12
            return across, across, 0.5 * radius**2
        case Floor():
            raise ValueError("a floor has no mass")


def label(robot: Robot, world: World, geom: int) -> str:
    """Returns the name of the link or object to which a geometry of the model belongs."""
    solids: tuple[Solid, ...] = robot.collision.solids
    return solids[geom].link if geom < len(solids) else world[geom - len(solids)].shape.name


def saved(robot: Robot, settings: PlantSettings, world: World, timestep: float) -> bytes:
    """Returns the content of an MJB file, for this version of MuJoCo.

    Args:
        robot, settings, world: as for `robots.Plant`. The file contains neither delay, lag and saturation of
            the motors nor the encoders.
        timestep: s.
    """
    model = compiled(robot, settings, world)
    model.opt.timestep = timestep
    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return content.tobytes()
