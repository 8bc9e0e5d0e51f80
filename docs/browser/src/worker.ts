/** The simulation, in a separate thread. It runs in real time, or reports its lower speed. */
import loadMujoco from "@mujoco/mujoco";
import { FALLBACKS, kernel } from "../../../himpc/export/files/himpc.mjs";
import { split } from "./code";
import { limit, unwrapped, type MeasureData, type Pack, type RobotData, type Scenes, type StepData } from "./data";
import { measured } from "./rows";
import { Session, type Tools } from "./session";

const FRAME_MS = 1000 / 60, BUSY_MS = 14, CURVE_S = 0.008;
const NAMES = ["torque", "velocity", "position"];

export interface Open { scenes: Pack<Scenes>; robot: RobotData; step: string | null; assignments: string[] }
export interface Verdict { claims: number[]; prediction: number }
/** What a figure draws at one moment. Rows of curves: t, errors of the tasks, torques and speeds as shares of their bounds. */
export interface Frame {
  t: number; running: boolean; poses: Float32Array; ghost: Float32Array | null; objects: Float32Array;
  curves: number[]; width: number; targets: { task: string; value: Float64Array }[]; binding: string[];
  fallback: string; speed: number; us: number; order: string[]; off: string[]; horizon: number;
  lost: boolean; restarted: boolean;
}
/** Messages that the simulation sends unasked. */
export type Told = { frame: Frame } | { verdict: Verdict } | { error: string };
// MuJoCo frees its objects by a method with this symbol as its name; Safari does not define the symbol yet.
(Symbol as { dispose?: symbol }).dispose ??= Symbol.for("Symbol.dispose");
const post = (told: Told | { answer: unknown } | { refusal: string }): void => (self as unknown as Worker).postMessage(told);

let tools: Omit<Tools, "scenes">, session: Session, ghost: Session | null = null, step: StepData | null = null;
let running = false, judged = false, due = 0, last = 0, speed = 1, us = 0, curves: number[] = [], restarted = true, timer = 0;

/** The functions that a page may call; each call ends before the next begins. */
const simulation = {
  /** Loads MuJoCo, which is compiled during decompression, and the kernel; returns the version of MuJoCo. */
  async load(mujoco: string, controller: string): Promise<string> {
    const compiled = WebAssembly.compileStreaming(unwrapped(mujoco));
    const create = await kernel(await (await unwrapped(controller)).arrayBuffer()), module = await compiled;
    const instantiateWasm = async (imports: WebAssembly.Imports, done: (made: WebAssembly.Instance) => void): Promise<void> =>
      done(await WebAssembly.instantiate(module, imports));
    tools = { create, mj: await loadMujoco({ instantiateWasm }) };
    return tools.mj.mj_versionString();
  },

  open({ scenes, robot, step: number, assignments }: Open): void {
    const whole: Tools = { ...tools, scenes };
    running = false;
    for (const each of session ? both() : []) each.plant.delete();
    step = number === null ? null : scenes.told.steps![number];
    session = new Session(whole, step ? step.scene : scenes.told.scene!, robot);
    ghost = step?.ghost ? new Session(whole, step.ghost, robot) : null;
    for (const each of assignments) simulation.set(...split(each));
    simulation.reset();
  },

  run(): void {
    clearTimeout(timer);
    running = !session.lost;
    pace();
    loop();
  },
  pause(): void { running = false; },
  reset(): void {
    for (const each of both()) each.reset();
    [judged, restarted, curves] = [false, true, []];
    pace();
  },
  /** Changes a setting of the run, and also of its ghost unless the step sets it for the ghost. */
  set(path: string, value: unknown): void {
    session.set(path, value);
    if (ghost && !step!.ghost_set.includes(path)) ghost.set(path, value);
  },
  target(task: string, value: number[]): void { for (const each of both()) each.move(task, value); },
  push(joint: number, force: number[], seconds: number): void {
    for (const each of both()) each.happen({ t: 0, event: "Push", joint, force, torque: [0, 0, 0], seconds });
  },

  /** Runs a number of periods from the start; returns their torques, row by row, and the measured claims and prediction. */
  replay(ticks: number): { tau: Float64Array } & Verdict {
    simulation.reset();
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

function pace(): void { [due, last, speed] = [0, performance.now(), 1]; }

/** Performs one period and stores its values for the plots. */
function advance(): void {
  const { rows, scene, robot } = session, at = (name: string): number[] => [...rows.at(-1, name)];
  session.tick();
  while (ghost && ghost.t + ghost.scene.period <= session.t + 1e-6) ghost.tick();
  if ((session.ticks - 1) % Math.max(1, Math.round(CURVE_S / scene.period))) return;
  curves.push(...at("t"), ...scene.tasks.map((task) => Math.hypot(...at(`error/${task.name}`))),
    ...at("tau").map((value, a) => value / limit(robot.tau_limit[a])),
    ...at("v").map((value, a) => value / limit(robot.v_limit[a])));
}

function verdict(): Verdict {
  const of = (measure: MeasureData): number => measured(measure, session.rows, ghost?.rows ?? null);
  return { claims: step ? step.claims.map((claim) => (claim.live ? of(claim.measure) : NaN)) : [],
    prediction: step?.prediction ? of(step.prediction.measure) : NaN };
}

/** Simulates up to the present, for a bounded time. If this time is not enough, simulated time runs slower. */
function loop(): void {
  if (!running) return;
  const begun = performance.now(), { period } = session.scene;
  const wanted = due += (begun - last) / 1000;
  last = begun;
  let count = 0;
  try {
    while (running && due > 0 && !session.lost && performance.now() - begun < BUSY_MS) {
      advance();
      due -= period;
      count++;
      if (!step || judged || session.t < step.scene.duration - 1e-9) continue;
      [judged, running] = [true, false];
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
  const { rows, plant, scene, horizon, lost, t } = session;
  const binding = (rows.count ? [...rows.at(-1, "at_bound")] : []).flatMap((bits, a) =>
    NAMES.filter((_, k) => bits > 0 && bits & (1 << k)).map((name) => `joint ${a + 1}: ${name}`));
  const targets = scene.tasks.filter(({ target }) => target === "position")
    .map(({ name }) => ({ task: name, value: session.target(name) }));
  const off = scene.levels.filter((level) => !level.enabled).map((level) => level.name);
  post({ frame: { t, running, poses: plant.poses(), ghost: ghost?.plant.poses() ?? null, objects: plant.objects(), targets,
    binding, curves, width: 1 + scene.tasks.length + 2 * plant.n, fallback: FALLBACKS[session.fallback], speed, us,
    order: scene.order, off, horizon, lost, restarted } });
  [restarted, curves] = [false, []];
}

let turn = Promise.resolve();
self.onmessage = ({ data: { name, given } }: MessageEvent<{ name: keyof Simulation; given: unknown[] }>) => {
  turn = turn.then(() => (simulation[name] as (...given: unknown[]) => unknown)(...given)).then((answer) => {
    if (!running && name !== "load") show();
    post({ answer });
  }).catch((error: Error) => post({ refusal: error.message ?? String(error) }));
};
