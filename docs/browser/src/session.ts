/** One run with its references, controller, plant, script and settings, as in lessons/session/torque.py. */
import type { MainModule } from "@mujoco/mujoco";
import { ENABLED, FALLBACKS, GAINS, LIMITS, M_BAR, OBJECT, ORDER, Q, R, TARGET, type Manifest, type kernel } from "../../../himpc/export/files/himpc.mjs";
import { each, limit, pieceOf, type Pack, type RobotData, type SceneData, type SceneEvent, type Scenes } from "./data";
import { Plant } from "./plant";
import { Rows } from "./rows";

const TRUTH_TICKS = 20, LOST_SPEED = 20;

type Create = Awaited<ReturnType<typeof kernel>>;
type Controller = ReturnType<Create>;
export interface Tools {
  mj: MainModule;
  create: Create;
  /** The scenes, and the memory of the exported controllers. */
  scenes: Pack<Scenes>;
}

export class Session {
  readonly plant: Plant;
  readonly rows: Rows;
  readonly scene: SceneData;
  controller!: Controller;
  manifest!: Manifest;
  lost = false;
  fallback = 0;
  private begun: Float64Array;
  private made = new Map<number, [Controller, Manifest]>();
  horizon: number;
  private script: SceneEvent[] = [];
  private pushUntil = Infinity;
  ticks = 0;
  private held: Float64Array | null = null;
  private waiting: Float64Array | null = null;
  private truth: [number, number] = [NaN, NaN];

  constructor(private tools: Tools, scene: SceneData, readonly robot: RobotData) {
    this.scene = structuredClone(scene);
    this.plant = new Plant(tools.mj, robot, this.scene);
    this.horizon = scene.horizon;
    [this.controller, this.manifest] = this.controllerFor(scene.horizon);
    this.rows = new Rows(scene.fields);
    this.begun = this.controller.view("raw").slice();
    this.reset();
  }

  get t(): number { return this.plant.t; }

  private controllerFor(N: number): [Controller, Manifest] {
    if (!(N in this.scene.images)) throw new Error(`this page has no controller with N = ${N}; himpc-lab has one`);
    const { manifest, memory } = this.scene.images[N];
    if (!this.made.has(N)) this.made.set(N, [this.tools.create(pieceOf(this.tools.scenes, memory), manifest), manifest]);
    return this.made.get(N)!;
  }

  reset(): void {
    const { q, v, tau } = this.scene.start;
    this.plant.reset(q, v, tau);
    // Targets return to their start; without this line the kernel would keep the dragged targets.
    this.controller.view("raw").set(this.begun);
    this.controller.reset(this.plant.tau);
    this.script = [...this.scene.events];
    this.ticks = this.fallback = 0;
    this.held = this.waiting = null;
    [this.pushUntil, this.truth, this.lost] = [Infinity, [NaN, NaN], false];
    this.rows.clear();
  }

  /** Performs one control period. */
  tick(): void {
    while (this.script.length && this.script[0].t <= this.t + 1e-9) this.happen(this.script.shift()!);
    if (this.t >= this.pushUntil - 1e-9) {
      this.plant.push(0, []);
      this.pushUntil = Infinity;
    }
    const { plant, scene, rows, controller } = this;
    const q = plant.q, v = plant.v, [q_measured, v_measured] = plant.measure(), before = plant.tau;
    // Objects that move, as in lessons/session/observed.py.
    for (const [at, [x, y, z, w, , , k, ...velocity]] of (this.manifest.objects.length ? plant.free() : []).entries())
      controller.set(OBJECT, scene.free[at].index, [x, y, z + scene.free[at].above, 2 * Math.atan2(k, w), ...velocity]);
    const [found, fallback] = controller.tick(q_measured, v_measured, before), tau = Float64Array.from(found);
    this.fallback = fallback;
    if (this.ticks++ % TRUTH_TICKS === 0) this.truth = plant.gauge(this.M_bar());
    const late = scene.deadline_ms > 0 && scene.deadline_ms < scene.solve_ms_per_knot * this.horizon - 1e-9;
    rows.next();
    const put = (values: Record<string, ArrayLike<number>>): void => {
      for (const name in values) rows.at(-1, name).set(values[name]);
    };
    put({ t: [plant.t], q, v, tau_demand: tau, tau_0: before, gauge_norm: [this.truth[0]], gauge_radius: [this.truth[1]],
      late: [Number(late)] });
    for (const [name, array, start, width] of scene.fields)
      if (array) put({ [name]: controller.view(array).subarray(start, start + width) });
    const [active, fallbacks, solvedIndex] = ["active", "fallback", "solved_index"].map((name) => controller.view(name));
    const solved = this.manifest.levels.filter(({ index }) => solvedIndex[index] >= 0);
    for (const { name, index } of solved) put({ [`active/${name}`]: [active[solvedIndex[index]]] });
    put({ unsolved: [FALLBACKS[fallback] === "hold" ? 1 : solved.filter(({ index }) => fallbacks[solvedIndex[index]] !== 0).length] });
    plant.step(this.applied(tau, late, before));
    put({ tau: plant.tau, contact_force: [plant.force] });
    const wild = v.some((each, a) => !(Math.abs(each) <= LOST_SPEED * limit(this.robot.v_limit[a])));
    this.lost ||= plant.broken || wild;
  }

  /** Returns the torque that acts: if the present one is late, an earlier one, as in lessons/session/deadline.py. */
  private applied(tau: Float64Array, late: boolean, before: Float64Array): Float64Array {
    const taken = late ? this.waiting ?? this.held ?? before : tau;
    this.waiting = late ? tau : null;
    return (this.held = taken);
  }

  happen(event: SceneEvent): void {
    if (event.event === "Set") this.set(event.path as string, event.value);
    else if (event.event === "MoveTarget") this.move(event.task as string, event.value as number[]);
    else if (event.event === "Push") {
      this.plant.push(event.joint as number, [...(event.force as number[]), ...(event.torque as number[])]);
      this.pushUntil = this.t + (event.seconds as number);
    } else if (event.event === "MoveLevel") {
      const order = this.scene.order.filter((name) => name !== event.level);
      order.splice(event.to as number, 0, event.level as string);
      this.set("order", order.join(","));
    } else throw new Error(`there is no ${event.event} here`);
  }

  move(task: string, value: number[]): void {
    const { index, target } = named(this.manifest.tasks, task, "task"), { axes } = named(this.scene.tasks, task, "task");
    const whole = target === "position" && value.length < 3 ? [..."xyz"].map((axis) => value[axes.indexOf(axis)] ?? 0) : value;
    this.controller.set(TARGET, index, whole);
  }

  /** Returns the target of a position task, m. */
  target(task: string): Float64Array {
    const { index, rows } = named(this.manifest.tasks, task, "task"), samples = this.controller.view("samples");
    const at = index * (samples.length / this.manifest.tasks.length);
    return samples.slice(at, at + rows);
  }

  private M_bar(): number[] { return this.scene.M_bar.map((each) => each * this.scene.M_bar_scale); }

  /** Changes a setting; the paths are those of himpc-lab. Throws an Error with a sentence if this is not possible. */
  set(path: string, value: unknown): void {
    const { scene } = this, [head, name, key] = path.split("."), { plant } = scene;
    if (path === "horizon") this.exchange(Number(value));
    else if (path === "order") this.arrange(Array.isArray(value) ? value as string[] : String(value).split(","));
    else if (head === "plant" && name in plant) {
      const whole = key ? each(plant[name as "friction"], this.plant.n).with(Number(key) - 1, value as number) : value;
      Object.assign(plant, { [name]: whole });
      this.plant.configure();
    } else {
      if (path === "M_bar_scale" || path === "M_bar") Object.assign(scene, { [path]: value });
      else if (head === "limits" && name in scene.limits && name !== "position") Object.assign(scene.limits, { [name]: value });
      else if (head === "tasks" && ["K_p", "K_v"].includes(key)) Object.assign(named(scene.tasks, name, "task"), { [key]: value });
      else if (head === "levels" && ["enabled", "Q", "R"].includes(key)) Object.assign(named(scene.levels, name, "level"), { [key]: value });
      else throw new Error(`${path} cannot be changed on this page, only in himpc-lab`);
      this.send();
    }
  }

  /** Gives the levels another order; the level damping stays last. */
  private arrange(order: string[]): void {
    const { levels } = this.manifest, own = this.scene.order, whole = [...order, "damping"].slice(0, levels.length);
    if (order.toSorted().join() !== own.toSorted().join()) throw new Error(`${order.join(", ")} is not an order of ${own.join(", ")}`);
    this.controller.set(ORDER, 0, whole.map((name) => levels.findIndex((level) => level.name === name)));
    this.scene.order = order;
  }

  /** Sends all numbers of the settings to the kernel; unchanged numbers have no effect. */
  private send(): void {
    const { robot, scene, controller, manifest } = this, { limits } = scene, ends = limits.position !== "off";
    const M_bar = this.M_bar(), before = controller.view("M_bar").slice(), weights = controller.view("R").slice();
    const changed = M_bar.some((value, a) => value !== before[a]), n = M_bar.length;
    const heavy = scene.R_on === "acceleration", strict = scene.controller !== "weighted";
    const scaled = (bounds: (number | null)[], on: boolean, scale: number, sign = 1): number[] =>
      bounds.map((each) => (on ? limit(each, sign) * scale : sign * Infinity));
    if (changed) controller.set(M_BAR, 0, M_bar);
    if (strict) this.arrange(scene.order);
    controller.set(LIMITS, 0, [...scaled(robot.tau_limit, limits.torque, limits.torque_scale),
      ...scaled(robot.v_limit, limits.velocity, limits.velocity_scale),
      ...scaled(robot.q_lower, ends, 1, -1), ...scaled(robot.q_upper, ends, 1)]);
    for (const { name, index, rows } of manifest.levels) {
      const own = scene.levels.find((level) => level.name === name);
      // The level damping is not in the scene: its R changes with M̄ only.
      const R_own = own ? each(own.R, n).map((value, a) => value * (heavy ? M_bar[a] ** 2 : 1)) :
        M_bar.map((value, a) => weights[index * n + a] * (heavy ? (value / before[a]) ** 2 : 1));
      if (own) controller.set(Q, index, each(own.Q, rows));
      if (strict) controller.set(R, index, R_own);
      if (own && strict) controller.set(ENABLED, index, [Number(own.enabled)]);
    }
    for (const { name, K_p, K_v } of scene.tasks) {
      const { index, rows } = named(manifest.tasks, name, "task");
      controller.set(GAINS, index, [...each(K_p, rows), ...each(K_v, rows)]);
    }
  }

  /** Continues with the controller of another N, as `recall` in himpc/tick/tick.py does. */
  private exchange(horizon: number): void {
    const { controller: old, horizon: N, manifest: { tasks }, plant: { n } } = this;
    if (horizon === N) return;
    [this.controller, this.manifest] = this.controllerFor(horizon);
    this.horizon = horizon;
    this.send();
    this.controller.reset(this.plant.tau);
    const now = this.controller, path = now.view("path"), target = now.view("target"), samples = now.view("samples");
    for (const name of ["q_was", "v_was", "limits", "scalars", "state", "raw", "target", "weight", "v_ramped"])
      now.view(name).set(old.view(name));
    now.view("state").fill(0, 3);  // the guard begins anew
    const [was, q_was, v_was, before] = ["path", "q_was", "v_was", "samples"].map((name) => old.view(name));
    for (let j = 1; j <= horizon; j++) for (let a = 0; a < n; a++) {
      const step = N > 1 ? was[N * n + a] - was[(N - 1) * n + a] : this.scene.period * v_was[a];
      path[j * n + a] = was[Math.min(j, N) * n + a] + q_was[a] - was[n + a] + Math.max(0, j - N) * step;
    }
    for (const name of ["known", "warm_count"]) (now.view(name) as unknown as BigInt64Array).fill(0n);
    const wide = before.length / tasks.length, room = samples.length / tasks.length;
    for (const { index } of tasks) {
      samples.set(before.subarray(index * wide, index * wide + Math.min(wide, room)), index * room);
      target[4 * index + 3] = Math.min(target[4 * index + 3], horizon + 1);
    }
  }
}

function named<T extends { name: string }>(list: T[], name: string, kind: string): T {
  const found = list.find((each) => each.name === name);
  if (!found) throw new Error(`there is no ${kind} ${name} here`);
  return found;
}
