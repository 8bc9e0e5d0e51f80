/** The simulation, in a thread of its own: it keeps pace with the clock, or says how much slower it is. */
import loadMujoco from "@mujoco/mujoco";
import { FALLBACKS, kernel } from "../../../himpc/export/files/himpc.mjs";
import { split } from "./code";
import { limit, unpacked, unwrapped, type Scenes, type StepData } from "./data";
import type { Call, Open, Opened, Told, Verdict } from "./messages";
import { measured } from "./rows";
import { Session, type Tools } from "./session";

const FRAME_MS = 1000 / 60, BUSY_MS = 14, CURVE_S = 0.008;
const NAMES = ["torque", "velocity", "position"];
const post = (told: Told, moved: Transferable[] = []): void => (self as unknown as Worker).postMessage(told, moved);

let tools: Omit<Tools, "image">;
let session: Session, ghost: Session | null = null, step: StepData | null = null;
let running = false, judged = false, due = 0, last = 0, speed = 1, us = 0, drawn = 0, restarted = true, timer = 0;

/** What a page may call; each call ends before the next begins. */
const simulation = {
  /** Loads MuJoCo, compiled while it is decompressed, and the kernel; returns the version of MuJoCo. */
  async load(mujoco: string, controller: string): Promise<string> {
    const compiled = WebAssembly.compileStreaming(unwrapped(mujoco));
    const create = await kernel(await unwrapped(controller).arrayBuffer()), module = await compiled;
    const instantiateWasm = async (imports: WebAssembly.Imports, done: (made: WebAssembly.Instance) => void): Promise<void> =>
      done(await WebAssembly.instantiate(module, imports));
    tools = { create, mj: await loadMujoco({ instantiateWasm }) };
    return tools.mj.mj_versionString();
  },

  async open({ scenes, robot, step: number, assignments }: Open): Promise<Opened> {
    const pack = await unpacked<Scenes>(scenes);
    const whole: Tools = { ...tools, image: (scene, key) => pack.piece(scene.images[key].memory) };
    session?.delete();
    ghost?.delete();
    step = number === null ? null : pack.told.steps![number];
    const scene = step ? step.scene : pack.told.scene!;
    session = new Session(whole, scene, robot);
    ghost = step?.ghost ? new Session(whole, step.ghost, robot) : null;
    for (const each of assignments) change(...split(each));
    running = false;
    restart();
    const units = new Map(scene.levels.flatMap((level) => level.tasks).map((task) => [task.name, task.unit]));
    const tasks = session.manifest.tasks.filter((task) => units.has(task.name));
    return { scene, step, tasks: tasks.map(({ name, target }) => ({ name, target, unit: units.get(name)! })) };
  },

  run(): void {
    clearTimeout(timer);
    running = !session.lost;
    pace();
    loop();
  },
  pause(): void { running = false; },
  reset(): void { restart(); },
  set(path: string, value: unknown): void { change(path, value); },
  target(task: string, value: number[]): void {
    for (const each of both()) each.move(task, value);
  },
  push(joint: number, force: number[], seconds: number): void {
    for (const each of both()) each.happen({ t: 0, event: "Push", joint, force, torque: [0, 0, 0], seconds });
  },

  /** The torques of so many periods from the start, row by row, and what they are judged to be. */
  replay(ticks: number): { tau: Float64Array } & Verdict {
    restart();
    const n = session.plant.n, tau = new Float64Array(ticks * n);
    for (let k = 0; k < ticks; k++) {
      advance();
      tau.set(session.rows.at(-1, "tau_demand"), k * n);
    }
    return { tau, ...verdict() };
  },
};
export type Simulation = typeof simulation;

const both = (): Session[] => (ghost ? [session, ghost] : [session]);

function restart(): void {
  for (const each of both()) each.reset();
  judged = false;
  drawn = 0;
  restarted = true;
  pace();
}

function pace(): void {
  [due, last, speed] = [0, performance.now(), 1];
}

/** A setting of the run and of its ghost, unless it is one by which they differ. */
function change(path: string, value: unknown): void {
  session.set(path, value);
  if (ghost && !step!.ghost_set.includes(path)) ghost.set(path, value);
}

function advance(): void {
  session.tick();
  while (ghost && ghost.t + ghost.scene.period <= session.t + 1e-6) ghost.tick();
}

function verdict(): Verdict {
  const of = (measure: StepData["claims"][0]["measure"]): number => measured(measure, session.rows, ghost?.rows ?? null);
  return { claims: step ? step.claims.map((claim) => (claim.live ? of(claim.measure) : NaN)) : [],
    prediction: step?.prediction ? of(step.prediction.measure) : NaN };
}

/** Simulates up to the present, for a bounded time; what is not reached is left out, and time runs slower. */
function loop(): void {
  if (!running) return;
  const begun = performance.now(), { period } = session.scene;
  due += (begun - last) / 1000;
  last = begun;
  const wanted = due;
  let count = 0;
  try {
    while (running && due > 0 && !session.lost && performance.now() - begun < BUSY_MS) {
      advance();
      due -= period;
      count++;
      if (!step || judged || session.t < step.scene.duration - 1e-9) continue;
      judged = true;
      running = false;
      post({ verdict: verdict() });
    }
  } catch (error) {
    running = false;
    post({ error: String(error) });
  }
  if (session.lost) running = false;
  if (due > period) due = 0;
  if (wanted > 0) speed += 0.05 * (Math.min(1, (count * period) / wanted) - speed);
  if (count) us += 0.1 * ((1e3 * (performance.now() - begun)) / count - us);
  show();
  if (running) timer = setTimeout(loop, Math.max(0, FRAME_MS - (performance.now() - begun))) as unknown as number;
}

function show(): void {
  const { rows, plant, scene, robot, manifest } = session, n = plant.n;
  const tasks = manifest.tasks.filter((task) => rows.has(`error/${task.name}`));
  const every = Math.max(1, Math.round(CURVE_S / scene.period)), total = rows.count + rows.gone, curves: number[] = [];
  for (let k = Math.ceil(Math.max(drawn, rows.gone) / every) * every; k < total; k += every) {
    const at = (name: string): number[] => [...rows.at(k - rows.gone, name)];
    curves.push(...at("t"), ...tasks.map((task) => Math.hypot(...at(`error/${task.name}`))),
      ...at("tau").map((value, a) => value / limit(robot.tau_limit[a])),
      ...at("v").map((value, a) => value / limit(robot.v_limit[a])));
  }
  drawn = total;
  const binding = (rows.count ? [...rows.at(-1, "at_bound")] : []).flatMap((bits, a) =>
    NAMES.filter((_, k) => bits > 0 && bits & (1 << k)).map((name) => `joint ${a + 1}: ${name}`));
  const targets = manifest.tasks.flatMap(({ name: task, target: kind }) => {
    const value = session.target(task);
    return value ? [{ task, kind, value: [...value] }] : [];
  });
  post({ frame: { t: session.t, running, poses: plant.poses(), ghost: ghost?.plant.poses() ?? null, targets, binding,
    curves: Float32Array.from(curves), width: 1 + tasks.length + 2 * n, fallback: FALLBACKS[session.fallback], speed, us,
    order: session.order, horizon: session.horizon, lost: session.lost, restarted } });
  restarted = false;
}

let turn = Promise.resolve();
self.onmessage = ({ data: { id, name, given } }: MessageEvent<Call>) => {
  turn = turn.then(() => (simulation[name] as (...given: unknown[]) => unknown)(...given)).then((value) => {
    post({ id, value });
    if (!running && name !== "load") show();
  }).catch((error: Error) => post({ id, error: error.message ?? String(error) }));
};
