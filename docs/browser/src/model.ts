/** The robot and its objects as MJCF: the text of docs/figures/model.py with the numbers of the settings. */
import { each, type Numbers, type PlantSettings, type RobotData, type SceneData } from "./data";

/** Returns the MJCF of a scene. If contacts are off, it contains no objects. */
export function mjcf({ model, plant }: SceneData, robot: RobotData): string {
  const text = plant.contacts ? model : model.replace(/<!-- objects -->.*<!-- objects -->/, "");
  return text.replace(/@(\w+) (\d+)@/g, (_, name: string, joint: string) => {
    const k = Number(joint) - 1, moved = inertia(robot, plant, k);
    const own = name === "friction" || name === "damping" || name === "armature" ? plant[name] : 0;
    const found: Record<string, Numbers | string | boolean> = { ...moved, stops: plant.joint_stops,
      gravity: plant.gravity ? robot.gravity : [0, 0, 0], contacts: plant.contacts ? "enable" : "disable" };
    return [found[name] ?? (each(own, robot.bodies.length)[k] || (name === "armature" ? robot.bodies[k].armature : 0))].flat().join(" ");
  });
}

/** Returns mass, centre and inertia of a body, scaled and with the payload at the tip, as robots/truth.py does. */
function inertia(robot: RobotData, plant: PlantSettings, k: number): Record<string, Numbers> {
  const own = robot.bodies[k], n = robot.bodies.length, load = plant.payload_kg;
  if (!own) return {};
  const scale = each(plant.inertia_scale, n)[k], mass = own.mass * each(plant.mass_scale, n)[k];
  const scaled = own.inertia.map((value) => value * scale);
  if (!(load > 0) || robot.tip.joint !== k + 1) return { mass, ipos: own.ipos, inertia: scaled };
  const whole = mass + load, reduced = (mass * load) / whole;
  const ipos = own.ipos.map((x, a) => (mass * x + load * robot.tip.pos[a]) / whole);
  const [x, y, z] = own.ipos.map((value, a) => value - robot.tip.pos[a]);
  const steiner = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z];
  return { mass: whole, ipos, inertia: scaled.map((value, a) => value + reduced * steiner[a]) };
}
