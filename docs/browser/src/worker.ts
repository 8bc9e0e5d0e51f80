/** The simulation, in a thread of its own: it keeps pace with the clock, or says how much slower it is. */
import loadMujoco from "@mujoco/mujoco";
import { FALLBACKS, kernel } from "../../../himpc/export/files/himpc.mjs";
import { limit, unpacked, type Pack, type SceneData, type StepData } from "./data";
import type { Frame, Open, ToPage, ToWorker } from "./messages";
import { measured } from "./rows";
import { Session, type Tools } from "./session";

const FRAME_MS = 1000 / 60, BUSY_MS = 14, CURVE_S = 0.008;
const NAMES = ["torque", "velocity", "position"];
const post = (message: ToPage, moved: Transferable[] = []): void => (self as unknown as Worker).postMessage(message, moved);

let tools: Omit<Tools, "image">;
let session: Session | null = null, ghost: Session | null = null, step: StepData | null = null;
let running = false, judged = false, due = 0, last = 0, speed = 1, us = 0, drawn = 0, restarted = true, timer = 0;

function open({ scenes, robot, step: number, assignments }: Open): void {
  session?.delete();
  ghost?.delete();
  const pack = unpacked<{ scene?: SceneData; steps?: Record<string, StepData> }>(scenes) as Pack<{ scene?: SceneData; steps?: Record<string, StepData> }>;
  const whole: Tools = { ...tools, image: (scene, key) => pack.piece(scene.images[key].memory) };
  step = number === null ? null : pack.told.steps![number];
  session = new Session(whole, step ? step.scene : pack.told.scene!, robot);
  ghost = step?.ghost ? new Session(whole, step.ghost, robot) : null;
  for (const each of assignments) {
    const [path, value] = [each.slice(0, each.indexOf("=")), each.slice(each.indexOf("=") + 1)];
    change(path, parsed(value));
  }
  running = judged = false;
  restart();
  const units = new Map(session.scene.levels.flatMap((level) => level.tasks).map((task) => [task.name, task.unit]));
  post({ kind: "opened", tasks: session.manifest.tasks.filter((task) => units.has(task.name)).map((task) =>
    ({ name: task.name, unit: units.get(task.name)!, target: task.target })) });
  show();
}

function parsed(value: string): unknown {
  try {
    return JSON.parse(value);
  } catch {
    return value;
  }
}

function restart(): void {
  session!.reset();
  ghost?.reset();
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
  session!.set(path, value);
  if (ghost && !step!.ghost_set.includes(path)) ghost.set(path, value);
}

function tick(): void {
  session!.tick();
  while (ghost && ghost.t + ghost.scene.period <= session!.t + 1e-6) ghost.tick();
  if (step && !judged && session!.t >= step.scene.duration - 1e-9) {
    judged = true;
    running = false;
    post({ kind: "judged", ...verdict() });
  }
}

function verdict(): { claims: number[]; prediction: number } {
  const of = (measure: StepData["claims"][0]["measure"]): number => measured(measure, session!.rows, ghost?.rows ?? null);
  return { claims: step ? step.claims.map((claim) => (claim.live ? of(claim.measure) : NaN)) : [],
    prediction: step?.prediction ? of(step.prediction.measure) : NaN };
}

/** Simulates up to the present, for a bounded time; what is not reached is left out, and time runs slower. */
function loop(): void {
  if (!session || !running) return;
  const begun = performance.now();
  due += (begun - last) / 1000;
  last = begun;
  const wanted = due;
  let done = 0, count = 0;
  try {
    while (running && due > 0 && !session.lost && performance.now() - begun < BUSY_MS) {
      tick();
      due -= session.scene.period;
      done += session.scene.period;
      count++;
    }
  } catch (error) {
    running = false;
    post({ kind: "failed", words: String(error) });
  }
  if (session.lost) running = false;
  if (due > session.scene.period) due = 0;
  if (wanted > 0) speed += 0.05 * (Math.min(1, done / wanted) - speed);
  if (count) us += 0.1 * ((1e3 * (performance.now() - begun)) / count - us);
  show();
  if (running) timer = setTimeout(loop, Math.max(0, FRAME_MS - (performance.now() - begun))) as unknown as number;
}

function show(): void {
  const { rows, plant, scene } = session!, n = plant.n, tasks = session!.manifest.tasks.filter((task) => rows.fields.has(`error/${task.name}`));
  const every = Math.max(1, Math.round(CURVE_S / scene.period)), width = 1 + tasks.length + 2 * n;
  const total = rows.count + rows.gone, first = Math.max(drawn, rows.gone), curves: number[] = [];
  for (let k = Math.ceil(first / every) * every; k < total; k += every) {
    const row = k - rows.gone, tau = rows.at(row, "tau"), v = rows.at(row, "v");
    curves.push(rows.at(row, "t")[0], ...tasks.map((task) => Math.hypot(...rows.at(row, `error/${task.name}`))));
    for (let a = 0; a < n; a++) curves.push(tau[a] / limit(session!.robot.tau_limit[a]));
    for (let a = 0; a < n; a++) curves.push(v[a] / limit(session!.robot.v_limit[a]));
  }
  drawn = total;
  const at = rows.count ? rows.at(rows.count - 1, "at_bound") : new Float64Array(n);
  const binding = [...at].flatMap((bits, a) => NAMES.filter((_, k) => bits > 0 && (bits & (1 << k))).map((name) => `joint ${a + 1}: ${name}`));
  const targets = session!.manifest.tasks.flatMap((task) => {
    const value = session!.target(task.name);
    return value ? [{ task: task.name, kind: task.target, value: [...value] }] : [];
  });
  const frame: Frame = { kind: "frame", t: session!.t, running, poses: plant.poses(), ghost: ghost?.plant.poses() ?? null,
    targets, curves: Float32Array.from(curves), width, binding, fallback: FALLBACKS[session!.fallback], speed, us,
    order: session!.order, horizon: session!.horizon, lost: session!.lost, over: judged, restarted };
  restarted = false;
  post(frame, [frame.poses.buffer, frame.curves.buffer]);
}

function replay(ticks: number): void {
  restart();
  const n = session!.plant.n, tau = new Float64Array(ticks * n), begun = performance.now();
  for (let k = 0; k < ticks; k++) {
    session!.tick();
    while (ghost && ghost.t + ghost.scene.period <= session!.t + 1e-6) ghost.tick();
    tau.set(session!.rows.at(session!.rows.count - 1, "tau_demand"), k * n);
  }
  post({ kind: "replayed", tau, ms: performance.now() - begun, ...verdict() }, [tau.buffer]);
}

async function take(message: ToWorker): Promise<void> {
  switch (message.kind) {
    case "load": {
      const mj = await loadMujoco({ wasmBinary: message.mujoco, locateFile: () => "mujoco.wasm" });
      tools = { mj, create: await kernel(message.kernel) };
      return post({ kind: "ready", mujoco: mj.mj_versionString() });
    }
    case "open": return open(message);
    case "replay": return replay(message.ticks);
    case "run":
      clearTimeout(timer);
      running = !session!.lost;
      pace();
      return loop();
    case "pause": running = false; break;
    case "reset": restart(); break;
    case "set": change(message.path, message.value); break;
    case "target":
      session!.move(message.task, message.value);
      ghost?.move(message.task, message.value);
      break;
    case "push":
      for (const each of ghost ? [session!, ghost] : [session!])
        each.happen({ t: 0, event: "Push", joint: message.joint, force: message.force, torque: [0, 0, 0], seconds: message.seconds });
  }
  if (!running) show();
}

let turn = Promise.resolve();
self.onmessage = (event: MessageEvent<ToWorker>) => {
  turn = turn.then(() => take(event.data)).catch((error: Error) => post({ kind: "refused", words: error.message ?? String(error) }));
};
