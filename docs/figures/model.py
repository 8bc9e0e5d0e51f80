"""A robot and its world as a MuJoCo XML text for a browser. It is the model of `robots.mechanics.model`, with
a placeholder `@NAME JOINT@` for each number that a setting of the plant changes while the robot moves."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np

from robots import PlantSettings, Robot
from robots.mechanics.model import compiled
from robots.world import World

KINDS = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_PLANE): "plane",
}
OBJECTS = "<!-- objects -->"
"""A mark before and after the objects. The objects are left out if there are no contacts."""


def model_of(robot: Robot, world: World) -> mujoco.MjModel:
    """Returns the nominal robot with contacts and stops, in its world."""
    return compiled(robot, PlantSettings(contacts=True, joint_stops=True), world)


def model_text(robot: Robot, world: World) -> str:
    """Returns the model as text. Placeholders of a joint k, counted from 1: @mass k@, @ipos k@, @inertia k@
    (xx yy zz xy xz yz), @armature k@, @damping k@, @friction k@, @stops k@ (true or false). Placeholders of
    the whole model: @gravity 0@ and @contacts 0@ (enable or disable)."""
    model = model_of(robot, world)
    top = np.flatnonzero(model.body_parentid == 0)[1:]
    objects = [body for body in top if model.body(body).name.startswith("object")]
    bodies = "".join(_body(model, robot, body) for body in top if body not in objects)
    meshes = "".join(
        _tag("mesh", name=f"hull{index}", inertia="convex", vertex=np.ravel(solid.points)) + "</mesh>"
        for index, solid in enumerate(robot.collision.solids)
        if solid.kind == "hull"
    )
    apart = "".join(
        _tag("exclude", body1=model.body(pair >> 16).name, body2=model.body(pair & 0xFFFF).name)
        + "</exclude>"
        for pair in model.exclude_signature.tolist()
    )
    motors = "".join(
        _tag("motor", name=f"motor{k}", joint=f"joint{k}") + "</motor>" for k in range(1, robot.n + 1)
    )
    return (
        '<mujoco><compiler inertiafromgeom="false" angle="radian"/>'
        '<option integrator="RK4" gravity="@gravity 0@">'
        '<flag autoreset="disable" contact="@contacts 0@"/></option>'
        f"<asset>{meshes}</asset><worldbody>{bodies}{OBJECTS}"
        + "".join(_body(model, robot, body) for body in objects)
        + f"{OBJECTS}</worldbody><contact>{apart}</contact><actuator>{motors}</actuator></mujoco>"
    )


def _body(model: mujoco.MjModel, robot: Robot, body: int) -> str:
    name = model.body(body).name
    text = _tag("body", name=name, pos=model.body_pos[body], quat=model.body_quat[body])
    k = int(name.removeprefix("body")) if name.startswith("body") else 0
    if k:
        text += f'<inertial pos="@ipos {k}@" mass="@mass {k}@" fullinertia="@inertia {k}@"/>'
    elif model.body_mass[body]:
        mass, inertia = model.body_mass[body], model.body_inertia[body]
        text += _tag("inertial", pos=np.zeros(3), mass=mass, diaginertia=inertia) + "</inertial>"
    for joint in np.flatnonzero(model.jnt_bodyid == body):
        text += _joint(model, joint, k)
    for geom in np.flatnonzero(model.geom_bodyid == body):
        text += _geom(model, robot, geom)
    children = (each for each in np.flatnonzero(model.body_parentid == body) if each != body)
    return text + "".join(_body(model, robot, child) for child in children) + "</body>"


def _joint(model: mujoco.MjModel, joint: int, k: int) -> str:
    if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
        return _tag("freejoint", name=model.joint(joint).name) + "</freejoint>"
    dof = model.jnt_dofadr[joint]
    ends: dict[str, object] = {}
    if model.jnt_limited[joint]:
        ends = {"limited": f"@stops {k}@", "range": model.jnt_range[joint]}
        ends |= {"solreflimit": model.jnt_solref[joint], "solimplimit": model.jnt_solimp[joint]}
    made = _tag(
        "joint",
        name=f"joint{k}",
        type="slide" if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE else "hinge",
        axis=model.jnt_axis[joint],
        armature=f"@armature {k}@",
        damping=f"@damping {k}@",
        frictionloss=f"@friction {k}@",
        solreffriction=model.dof_solref[dof],
        solimpfriction=model.dof_solimp[dof],
        **(ends or {"limited": "false"}),
    )
    return made + "</joint>"


def _geom(model: mujoco.MjModel, robot: Robot, geom: int) -> str:
    """Returns a geom as text. A hull is written in the coordinates of its body. In MuJoCo's compiled model
    the origin of the geom is the centre of the hull."""
    solids = robot.collision.solids
    told: dict[str, object] = {"name": model.geom(geom).name, "priority": model.geom_priority[geom]}
    told |= {"friction": model.geom_friction[geom], "solref": model.geom_solref[geom]}
    told |= {"solimp": model.geom_solimp[geom]}
    if geom < len(solids) and solids[geom].kind == "hull":
        return _tag("geom", type="mesh", mesh=f"hull{geom}", **told) + "</geom>"
    placed = {"pos": model.geom_pos[geom], "quat": model.geom_quat[geom]}
    size = model.geom_size[geom]
    return _tag("geom", type=KINDS[int(model.geom_type[geom])], size=size, **placed, **told) + "</geom>"


def _tag(name: str, /, **given: object) -> str:
    """Returns the start tag of an element. Its numbers have all their digits."""

    def told(value: object) -> str:
        if isinstance(value, str):
            return value
        return " ".join(repr(each) for each in np.ravel(np.asarray(value)).tolist())

    return f"<{name} " + " ".join(f"{key}={quoteattr(told(value))}" for key, value in given.items()) + ">"
