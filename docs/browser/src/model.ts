/** The robot and its floor in MuJoCo's language, with the numbers of robots/mechanics/model.py. */
import { each, limit, type Body, type Floor, type PlantSettings, type RobotData } from "./data";

const STICTION = 'solreffriction="0.002 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"';
const CONTACT = 'solref="0.004 1" solimp="0.95 0.99 0.001 0.5 2"';
const STOP = 'solreflimit="0.004 1" solimplimit="0.95 0.99 0.001 0.5 2"';
const FAR = 1e6;

interface Inertia { mass: number; ipos: number[]; inertia: number[] }

/** MJCF of a robot under plant settings; body k carries joint k. */
export function mjcf(robot: RobotData, plant: PlantSettings, world: Floor[]): string {
  const n = robot.bodies.length, friction = each(plant.friction, n), damping = each(plant.damping, n);
  const armature = each(plant.armature, n), touching = plant.contacts;
  const solids = (joint: number): string => !touching ? "" : robot.solids.map((solid, index) => {
    if (solid.joint !== joint) return "";
    const hull = solid.kind === "hull";
    const size = hull ? `type="mesh" mesh="hull${index}"` :
      `type="${solid.kind}" size="${solid.size.join(" ")}" pos="${solid.pos.join(" ")}" quat="${solid.quat.join(" ")}"`;
    return `<geom name="solid${index}" ${size} friction="0.5 0.005 0.0001" ${CONTACT}/>`;
  }).join("");
  const body = (k: number): string => {
    const { pos, quat, prismatic, axis } = robot.bodies[k - 1], moved = inertia(robot, plant, k);
    const [low, high] = [limit(robot.q_lower[k - 1], -1), limit(robot.q_upper[k - 1])];
    const stops = plant.joint_stops && (isFinite(low) || isFinite(high));
    const range = stops ? `limited="true" range="${Math.max(low, -FAR)} ${Math.min(high, FAR)}" ${STOP}` : 'limited="false"';
    return `<body name="body${k}" pos="${pos.join(" ")}" quat="${quat.join(" ")}">` +
      `<inertial pos="${moved.ipos.join(" ")}" mass="${moved.mass}" fullinertia="${moved.inertia.join(" ")}"/>` +
      `<joint name="joint${k}" type="${prismatic ? "slide" : "hinge"}" axis="${axis.join(" ")}" ${range} ` +
      `armature="${armature[k - 1]}" damping="${damping[k - 1]}" frictionloss="${friction[k - 1]}" ${STICTION}/>` +
      solids(k) + robot.bodies.map((child, at) => (child.parent === k ? body(at + 1) : "")).join("") + "</body>";
  };
  const roots = robot.bodies.map((each, at) => (each.parent === 0 ? body(at + 1) : "")).join("");
  const base = touching ? `<body name="base">${solids(0)}</body>` : "";
  const floors = touching ? world.map((floor, index) => `<body name="object${index}" pos="0 0 ${floor.height}">` +
    `<geom name="shape${index}" type="plane" size="0 0 1" friction="${floor.friction} 0.005 0.0001" priority="1" ` +
    `${CONTACT}/></body>`).join("") : "";
  const meshes = touching ? robot.solids.map((solid, index) => solid.kind !== "hull" ? "" :
    `<mesh name="hull${index}" inertia="convex" vertex="${solid.points.flat().join(" ")}"/>`).join("") : "";
  const named = (joint: number): string => (joint ? `body${joint}` : "base");
  const pairs = touching ? robot.excluded.map(([a, b]) => `<exclude body1="${named(a)}" body2="${named(b)}"/>`).join("") : "";
  return '<mujoco><compiler inertiafromgeom="false" angle="radian"/>' +
    `<option integrator="RK4" gravity="${plant.gravity ? robot.gravity.join(" ") : "0 0 0"}">` +
    `<flag autoreset="disable" contact="${touching ? "enable" : "disable"}"/></option><asset>${meshes}</asset>` +
    `<worldbody>${roots}${base}${floors}</worldbody><contact>${pairs}</contact><actuator>` +
    robot.bodies.map((_, at) => `<motor name="motor${at + 1}" joint="joint${at + 1}"/>`).join("") + "</actuator></mujoco>";
}

/** A body with scaled mass and inertia and, at the tip, the payload: robots/truth.py. */
function inertia(robot: RobotData, plant: PlantSettings, joint: number): Inertia {
  const n = robot.bodies.length, own: Body = robot.bodies[joint - 1], scale = each(plant.inertia_scale, n)[joint - 1];
  const found = { mass: own.mass * each(plant.mass_scale, n)[joint - 1], ipos: own.ipos,
    inertia: own.inertia.map((value) => value * scale) };
  if (!(plant.payload_kg > 0) || robot.tip.joint !== joint) return found;
  const load = plant.payload_kg, mass = found.mass + load, reduced = (found.mass * load) / mass;
  const ipos = found.ipos.map((x, a) => (found.mass * x + load * robot.tip.pos[a]) / mass);
  const [x, y, z] = found.ipos.map((value, a) => value - robot.tip.pos[a]);
  const [xx, yy, zz, xy, xz, yz] = found.inertia;
  return { mass, ipos, inertia: [xx + reduced * (y * y + z * z), yy + reduced * (x * x + z * z),
    zz + reduced * (x * x + y * y), xy - reduced * x * y, xz - reduced * x * z, yz - reduced * y * z] };
}
