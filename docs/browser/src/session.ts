/** One run: references, controller, plant, script and settings; lessons/session/torque.py. */
import type { MainModule } from "@mujoco/mujoco";
import { ENABLED, FALLBACKS, GAINS, LIMITS, M_BAR, Q, R, TARGET, type Controller, type Manifest } from "../../../himpc/export/files/himpc.mjs";
import { each, limit, type LevelData, type PlantSettings, type RobotData, type SceneData, type SceneEvent, type TaskData } from "./data";
import { Plant } from "./plant";
import { Rows, gauge } from "./rows";

const TRUTH_TICKS = 20, LOST_SPEED = 20;
const LIMIT_FIELDS: [string, number][] = [["tau_lower", 0], ["tau_upper", 1], ["v_limit", 2], ["q_lower", 6], ["q_upper", 7]];

export interface Tools {
  mj: MainModule;
  create(image: Uint8Array, manifest: Manifest): Controller;
  /** The memory of an exported controller. */
  image(scene: SceneData, key: string): Uint8Array;
}

export class Session {
  readonly plant: Plant;
  readonly rows: Rows;
  readonly scene: SceneData;
  controller!: Controller;
  manifest!: Manifest;
  lost = false;
  fallback = 0;
  private begun: Map<string, Float64Array>;
  private key = "";
  private made = new Map<string, [Controller, Manifest]>();
  private script: SceneEvent[] = [];
  private pushUntil = Infinity;
  private ticks = 0;
  private held: Float64Array | null = null;
  private waiting: Float64Array | null = null;
  private truth: [number, number] = [NaN, NaN];

  constructor(private tools: Tools, scene: SceneData, readonly robot: RobotData) {
    this.scene = structuredClone(scene);
    this.plant = new Plant(tools.mj, robot, this.scene.plant, scene.world);
    this.key = `${scene.horizon}|${scene.order.join(",")}`;
    [this.controller, this.manifest] = this.controllerFor(this.key);
    this.rows = new Rows(this.layout());
    this.begun = new Map(this.manifest.tasks.map((task) => [task.name, this.raw(task.index).slice()]));
    this.reset();
  }

  get t(): number { return this.plant.t; }
  get horizon(): number { return Number(this.key.split("|")[0]); }
  get order(): string[] { return this.key.split("|")[1].split(","); }
  level(name: string): LevelData { return named(this.scene.levels, name, "level"); }
  task(name: string): TaskData { return named(this.scene.levels.flatMap((level) => level.tasks), name, "task"); }
  has(horizon: number, order: string[]): boolean { return `${horizon}|${order.join(",")}` in this.scene.images; }

  private controllerFor(key: string): [Controller, Manifest] {
    const known = this.made.get(key);
    if (known) return known;
    const { manifest } = this.scene.images[key];
    const arrays = manifest.arrays.map(([name, type, shape, offset]) => ({ name, type, shape, offset }));
    const whole = { ...manifest, arrays };
    const made: [Controller, Manifest] = [this.tools.create(this.tools.image(this.scene, key), whole), whole];
    this.made.set(key, made);
    return made;
  }

  private raw(task: number): Float64Array {
    const raw = this.controller.view("raw"), width = raw.length / this.manifest.tasks.length;
    return raw.subarray(task * width, (task + 1) * width);
  }

  private layout(): [string, number][] {
    const n = this.plant.n, one = ["t", "priority_leak", "gauge_norm", "gauge_radius", "unsolved", "late"];
    const joint = ["q", "v", "tau", "tau_demand", "at_bound", "delta_tau", "tau_0", ...LIMIT_FIELDS.map(([name]) => name)];
    return [...one.map((name): [string, number] => [name, 1]), ...joint.map((name): [string, number] => [name, n]),
      ...this.manifest.tasks.flatMap((task): [string, number][] => [[`error/${task.name}`, task.rows], [`x/${task.name}`, task.rows]]),
      ...this.manifest.levels.map((level): [string, number] => [`active/${level.name}`, 1])];
  }

  reset(): void {
    const { q, v, tau } = this.scene.start;
    this.plant.reset(q, v, tau);
    // Targets return to where they were at the start; the kernel alone would leave them where they were dragged to.
    for (const task of this.manifest.tasks) this.raw(task.index).set(this.begun.get(task.name)!);
    this.controller.reset(this.plant.tau);
    this.script = [...this.scene.events];
    this.pushUntil = Infinity;
    this.ticks = this.fallback = 0;
    this.held = this.waiting = null;
    this.truth = [NaN, NaN];
    this.lost = false;
    this.rows.clear();
  }

  /** One control period. */
  tick(): void {
    while (this.script.length && this.script[0].t <= this.t + 1e-9) this.happen(this.script.shift()!);
    if (this.t >= this.pushUntil - 1e-9) {
      this.plant.push(0, []);
      this.pushUntil = Infinity;
    }
    const { plant, scene } = this, n = plant.n, T_s = scene.period, row = this.rows.next(), at = this.rows.count - 1;
    const put = (name: string, values: ArrayLike<number>): void => row.set(values, this.rows.fields.get(name)![0]);
    const q = plant.q, v = plant.v, [q_measured, v_measured] = plant.measure(T_s), before = plant.tau;
    const [found, fallback] = this.controller.tick(q_measured, v_measured, before), tau = Float64Array.from(found);
    this.fallback = fallback;
    const f = (name: string): Float64Array => this.controller.view(name);
    if (this.ticks++ % TRUTH_TICKS === 0) this.truth = gauge(plant.massMatrix(), this.M_bar());
    const late = scene.deadline_ms > 0 && scene.deadline_ms < scene.solve_ms_per_knot * this.horizon - 1e-9;
    put("t", [plant.t]);
    put("q", q);
    put("v", v);
    put("tau_demand", tau);
    put("tau_0", before);
    put("at_bound", f("at_bound"));
    put("delta_tau", f("delta_tau"));
    put("priority_leak", f("priority_leak"));
    put("gauge_norm", [this.truth[0]]);
    put("gauge_radius", [this.truth[1]]);
    put("late", [late ? 1 : 0]);
    const limits = f("limits"), error = f("error"), value = f("value"), places = f("task"), rung = f("rung"), active = f("active");
    for (const [name, place] of LIMIT_FIELDS) put(name, limits.subarray(place * n, (place + 1) * n));
    for (const task of this.manifest.tasks) {
      const first = Number(places[4 * task.index + 2]);
      put(`error/${task.name}`, error.subarray(first, first + task.rows));
      put(`x/${task.name}`, value.subarray(first, first + task.rows));
    }
    const solved = this.solved();
    solved.forEach((name, place) => put(`active/${name}`, [active[place]]));
    put("unsolved", [FALLBACKS[fallback] === "hold" ? 1 : solved.filter((_, place) => rung[place] !== 0).length]);
    plant.step(this.applied(tau, late, before), T_s);
    this.rows.at(at, "tau").set(plant.tau);
    const wild = v.some((each, a) => !(Math.abs(each) <= LOST_SPEED * limit(this.robot.v_limit[a])));
    this.lost ||= plant.broken || wild;
  }

  /** The torque that acts although that of this period may be late: lessons/session/deadline.py. */
  private applied(tau: Float64Array, late: boolean, before: Float64Array): Float64Array {
    const taken = late ? this.waiting ?? this.held ?? before : tau;
    this.waiting = late ? tau : null;
    return (this.held = taken);
  }

  /** The levels that the controller solves, in order. */
  solved(): string[] {
    const on = new Set(this.scene.levels.filter((level) => level.enabled).map((level) => level.name));
    const count = Number(this.controller.view("sizes")[4]);
    return this.manifest.levels.map((level) => level.name).filter((name) => on.has(name) || name === "damping").slice(0, count);
  }

  happen(event: SceneEvent): void {
    if (event.event === "Set") this.set(event.path as string, event.value);
    else if (event.event === "MoveTarget") this.move(event.task as string, event.value as number[]);
    else if (event.event === "Push") {
      this.plant.push(event.joint as number, [...(event.force as number[]), ...(event.torque as number[])]);
      this.pushUntil = this.t + (event.seconds as number);
    } else if (event.event === "MoveLevel") {
      const order = this.order.filter((name) => name !== event.level);
      order.splice(event.to as number, 0, event.level as string);
      this.set("order", order.join(","));
    } else throw new Error(`there is no ${event.event} here`);
  }

  move(task: string, value: number[]): void {
    const { index, target } = named(this.manifest.tasks, task, "task"), { axes } = this.task(task);
    const whole = target === "position" && value.length < 3 ? [..."xyz"].map((axis) => value[axes.indexOf(axis)] ?? 0) : value;
    this.controller.set(TARGET, index, whole);
  }

  /** Where the target of a task is: the numbers of its value, a rotation row by row. */
  target(task: string): Float64Array | null {
    const { index, rows, target } = named(this.manifest.tasks, task, "task"), samples = this.controller.view("samples");
    const stride = samples.length / this.manifest.tasks.length, at = index * stride;
    return target === "none" || target === "fixed" ? null : samples.slice(at, at + (target === "orientation" ? 9 : rows));
  }

  private M_bar(): number[] { return this.scene.M_bar.map((each) => each * this.scene.M_bar_scale); }

  /** Changes a setting; the paths are those of himpc-lab. Throws an Error with a sentence if it cannot. */
  set(path: string, value: unknown): void {
    const { scene } = this, [head, name, key] = path.split("."), n = this.plant.n;
    if (path === "horizon" || path === "order") {
      const order = Array.isArray(value) ? value as string[] : String(value).split(",");
      this.exchange(path === "horizon" ? Number(value) : this.horizon, path === "order" ? order : this.order);
    } else if (path === "M_bar_scale" || path === "M_bar") {
      const before = this.M_bar();
      Object.assign(scene, { [path]: value });
      this.sendM_bar(before);
    } else if (head === "limits" && name in scene.limits && name !== "position") {
      Object.assign(scene.limits, { [name]: value });
      this.sendLimits();
    } else if (head === "plant" && name in scene.plant && name !== "diagonal_scale") {
      const { plant } = scene;
      if (key) (plant as unknown as Record<string, unknown>)[name] = each(plant[name as "friction"], n).map((own, a) => (a === Number(key) - 1 ? value : own));
      else Object.assign(plant, { [name]: value });
      this.plant.configure(plant as PlantSettings);
    } else if (head === "tasks" && (key === "K_p" || key === "K_v")) {
      this.task(name)[key] = value as number;
      this.sendGains(name);
    } else if (head === "levels" && key === "enabled") {
      this.level(name).enabled = value as boolean;
      this.controller.set(ENABLED, named(this.manifest.levels, name, "level").index, [value ? 1 : 0]);
    } else if (head === "levels" && (key === "Q" || key === "R")) {
      this.level(name)[key] = value as number;
      if (key === "Q") this.sendQ(name);
      else this.sendR(name);
    } else throw new Error(`${path} cannot be changed here; himpc-lab can`);
  }

  private sendM_bar(before: number[]): void {
    const now = this.M_bar(), weights = Float64Array.from(this.controller.view("R"));
    this.controller.set(M_BAR, 0, now);
    if (this.scene.R_on !== "acceleration") return;
    for (const { index } of this.manifest.levels)
      this.controller.set(R, index, now.map((value, a) => weights[index * now.length + a] * (value / before[a]) ** 2));
  }
  private sendLimits(): void {
    const { robot, scene: { limits } } = this, position = limits.position !== "off";
    const rows = [robot.tau_limit.map((each) => (limits.torque ? limit(each) * limits.torque_scale : Infinity)),
      robot.v_limit.map((each) => (limits.velocity ? limit(each) * limits.velocity_scale : Infinity)),
      robot.q_lower.map((each) => (position ? limit(each, -1) : -Infinity)),
      robot.q_upper.map((each) => (position ? limit(each) : Infinity))];
    this.controller.set(LIMITS, 0, rows.flat());
  }
  private sendGains(name: string): void {
    const { index, rows } = named(this.manifest.tasks, name, "task"), { K_p, K_v } = this.task(name);
    this.controller.set(GAINS, index, [...each(K_p, rows), ...each(K_v, rows)]);
  }
  private sendQ(name: string): void {
    const { index, rows } = named(this.manifest.levels, name, "level");
    this.controller.set(Q, index, each(this.level(name).Q, rows));
  }
  private sendR(name: string): void {
    const M_bar = this.M_bar(), squared = this.scene.R_on === "acceleration";
    const weights = each(this.level(name).R, M_bar.length).map((each, a) => each * (squared ? M_bar[a] ** 2 : 1));
    this.controller.set(R, named(this.manifest.levels, name, "level").index, weights);
  }

  /** Goes on with a controller of another order or N: himpc/tick/tick.py, `recall`. */
  private exchange(horizon: number, order: string[]): void {
    const key = `${horizon}|${order.join(",")}`, n = this.plant.n;
    if (key === this.key) return;
    if (!(key in this.scene.images)) throw new Error(`this page has no controller with N = ${horizon} and the order ${order.join(", ")}; himpc-lab has`);
    const old = this.controller, then = this.manifest, solved = this.solved(), N = this.horizon;
    [this.controller, this.manifest] = this.controllerFor(key);
    this.key = key;
    const now = this.controller, f = (name: string): [Float64Array, Float64Array] => [old.view(name), now.view(name)];
    this.sendM_bar(this.M_bar());
    this.sendLimits();
    for (const level of this.scene.levels) {
      this.sendQ(level.name);
      if (this.scene.controller !== "weighted") {
        now.set(ENABLED, named(this.manifest.levels, level.name, "level").index, [level.enabled ? 1 : 0]);
        this.sendR(level.name);
      }
      for (const task of level.tasks) this.sendGains(task.name);
    }
    now.reset(this.plant.tau);
    for (const name of ["q_was", "v_was", "limits", "scalars", "state"]) f(name)[1].set(f(name)[0]);
    const [was, path] = f("path"), [q_was] = f("q_was");
    for (let j = 0; j <= horizon; j++) for (let a = 0; a < n; a++) {
      if (N === horizon) path[j * n + a] = was[j * n + a];
      else if (j) {
        const beyond = Math.max(0, j - N), step = N > 1 ? was[N * n + a] - was[(N - 1) * n + a] : this.scene.period * f("v_was")[0][a];
        path[j * n + a] = was[Math.min(j, N) * n + a] + q_was[a] - was[n + a] + beyond * step;
      }
    }
    const [, known] = f("known") as unknown as [BigInt64Array, BigInt64Array];
    known[0] = known[1] = 0n;
    (now.view("warm_count") as unknown as BigInt64Array).fill(0n);
    const [U, U_was] = f("U_was"), size = N * n;
    if (N === horizon) this.solved().forEach((name, place) => {
      const from = solved.indexOf(name);
      if (from < 0) return;
      U_was.set(U.subarray(from * size, (from + 1) * size), place * size);
      known[1] = 1n;
    });
    for (const task of this.manifest.tasks) {
      const from = named(then.tasks, task.name, "task").index;
      for (const name of ["raw", "target", "samples"]) {
        const [a, b] = f(name), [wide, narrow] = [a.length / then.tasks.length, b.length / then.tasks.length];
        b.set(a.subarray(from * wide, from * wide + Math.min(wide, narrow)), task.index * narrow);
      }
      const target = now.view("target");
      target[4 * task.index + 3] = Math.min(target[4 * task.index + 3], horizon + 1);
      const [a, b] = f("weight"), [first, second] = f("task");
      const start = Number(first[4 * from + 2]);
      b.set(a.subarray(start, start + task.rows), Number(second[4 * task.index + 2]));
    }
  }

  delete(): void { this.plant.delete(); }
}

function named<T extends { name: string }>(list: T[], name: string, kind: string): T {
  const found = list.find((each) => each.name === name);
  if (!found) throw new Error(`there is no ${kind} ${name} here`);
  return found;
}
