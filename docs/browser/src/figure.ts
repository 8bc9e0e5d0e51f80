/** One live figure: the simulation in its thread, the view, the plots, the controls and, in a lesson, the claims. */
import { assignment, encode, parsed, type State } from "./code";
import { unpacked, unwrapped, type RobotData, type SceneData, type StepData } from "./data";
import type { Frame, ToPage, ToWorker } from "./messages";
import { LEVELS, Panel, button, element } from "./panel";
import { Plots } from "./plots";
import { holds } from "./rows";
import { View } from "./view";

export interface About { version: string; commit: string; kernel: string; mujoco: string }
declare global {
  interface Window { HIMPC_ABOUT: About }
}

/** A thread with MuJoCo and the kernel in it, as long as it lives. */
export class Engine {
  private worker: Worker;
  hear: (message: ToPage) => void = () => {};
  mujoco = "";

  constructor() {
    this.worker = new Worker(URL.createObjectURL(new Blob([WORKER_TEXT], { type: "text/javascript" })));
    this.worker.onmessage = (event: MessageEvent<ToPage>) => this.hear(event.data);
  }

  async load(): Promise<this> {
    const [mujoco, kernel] = await Promise.all([unwrapped("mujoco"), unwrapped("kernel")]);
    const answer = await this.ask({ kind: "load", mujoco, kernel }, "ready", [mujoco, kernel]);
    this.mujoco = answer.mujoco;
    return this;
  }

  say(message: ToWorker, moved: Transferable[] = []): void { this.worker.postMessage(message, moved); }

  /** Says something and waits for its answer; throws an Error with the sentence of a refusal. */
  ask<K extends ToPage["kind"]>(message: ToWorker, kind: K, moved: Transferable[] = []): Promise<Extract<ToPage, { kind: K }>> {
    return new Promise((done, fail) => {
      const hear = ({ data }: MessageEvent<ToPage>): void => {
        if (data.kind !== kind && data.kind !== "refused" && data.kind !== "failed") return;
        this.worker.removeEventListener("message", hear);
        if (data.kind === kind) done(data as Extract<ToPage, { kind: K }>);
        else fail(new Error((data as { words: string }).words));
      };
      this.worker.addEventListener("message", hear);
      this.say(message, moved);
    });
  }

  end(): void { this.worker.terminate(); }
}

export interface Asked {
  /** "scene/NAME" or "lesson/NAME", and the step. */
  pack: string; robot: string; step: string | null; assignments: string[]; wide: boolean; running: boolean;
}

export class Figure {
  /** None in a browser without WebGL. */
  private view: View | null = null;
  private plots!: Plots;
  private panel!: Panel;
  private scene!: SceneData;
  private step: StepData | null = null;
  private changes = new Map<string, unknown>();
  private raw = new Map<string, number[]>();
  private running = false;
  private status = element("p", { class: "hl-status" });
  private notice = element("p", { class: "hl-notice" });
  private run = button("Run", () => this.toggle());
  private code = element("input", { readOnly: true, type: "text" });
  private guess: (() => number | null) | null = null;
  private claims: HTMLElement[] = [];
  private answer = element("p", { class: "hl-answer" });
  /** The last moment that was shown; for tests. */
  frame: Frame | null = null;

  constructor(private root: HTMLElement, private engine: Engine, private asked: Asked) {
    this.notice.setAttribute("role", "status");
    this.code.setAttribute("aria-label", "State code");
  }

  async open(): Promise<this> {
    const { asked, engine } = this, told = unpacked<{ scene?: SceneData; steps?: Record<string, StepData> }>(await unwrapped(asked.pack)).told;
    this.step = asked.step === null ? null : told.steps![asked.step];
    this.scene = structuredClone(this.step ? this.step.scene : told.scene!);
    const robot = unpacked<RobotData>(await unwrapped(`robot/${asked.robot}`)), { scene } = this;
    const colours = Object.fromEntries(scene.levels.flatMap((level, k) => level.tasks.map((task) => [task.name, LEVELS[k % 6]])));
    const { tasks } = await this.opened(asked.assignments, robot.told);
    for (const each of asked.assignments) this.known(each.slice(0, each.indexOf("=")), parsed(each.slice(each.indexOf("=") + 1)));
    const places = tasks.filter((task) => this.placed(task.name) && task.target === "position");
    const draggable = places.map((task) => ({ task: task.name, axes: this.axes(task.name) }));
    const planar = robot.told.bodies.every((body) => Math.abs(body.pos[2]) < 1e-6);
    const balls = scene.levels.flatMap((level) => level.tasks).filter((task) => task.frame).map((task) => [task.name, colours[task.name]]);
    try {
      this.view = new View(robot, Object.fromEntries(balls), planar, new Set(draggable.map((each) => each.task)));
      this.view.onMove = (task, place) => this.drag(task, place);
    } catch {
      this.say("This browser has no WebGL, which the 3D view needs: plots and controls work without it.");
    }
    this.plots = new Plots(tasks.map((task) => ({ ...task, colour: colours[task.name] })), robot.told.joints.length);
    this.panel = new Panel(scene, robot.told, { set: (path, value) => this.set(path, value),
      push: (joint, force) => engine.say({ kind: "push", joint, force, seconds: 0.1 }),
      target: (task, place) => this.drag(task, place) }, draggable, asked.wide);
    engine.hear = (message) => this.hear(message);
    this.lay();
    engine.say({ kind: "pause" });
    if (asked.running) this.toggle();
    return this;
  }

  private async opened(assignments: string[], robot: RobotData): Promise<Extract<ToPage, { kind: "opened" }>> {
    const scenes = await unwrapped(this.asked.pack);
    return this.engine.ask({ kind: "open", scenes, robot, step: this.asked.step, assignments }, "opened", [scenes]);
  }

  private placed(task: string) { return this.scene.levels.flatMap((level) => level.tasks).find((each) => each.name === task)?.frame; }
  private axes(task: string): string { return this.scene.levels.flatMap((level) => level.tasks).find((each) => each.name === task)!.axes; }

  private lay(): void {
    const { step, asked, engine } = this, about = window.HIMPC_ABOUT;
    const bar = element("div", { class: "hl-bar" }, this.run, button("Reset", () => this.reset()), this.status);
    const link = element("div", { class: "hl-bar" }, button("Copy the link", () => this.copy()), this.code);
    const missing = step ? (step.ghost_words ? (step.ghost ? `Violet: the ghost, ${step.ghost_words}. ` :
      `The ghost (${step.ghost_words}) runs in himpc-lab only: ${step.ghost_missing}. `) : "") : "";
    const foot = element("p", { class: "hl-small" }, `${missing}Kernel ${about.kernel} of himpc-lab ${about.version}, commit ${about.commit}, ` +
      `as WebAssembly; the robot is simulated by MuJoCo ${engine.mujoco}, in himpc-lab by ${about.mujoco}. Unlike himpc-lab this page has ` +
      "no controllers that need Python (OSF, HQP, HTMPC), no tasks to add, no recordings and no QP drawings, and three rare fallbacks are missing. " +
      "The code opens in himpc-lab: himpc-lab --state CODE.");
    this.root.classList.add("hl-figure");
    this.root.classList.toggle("hl-wide", asked.wide);
    const view = element("div", { class: "hl-view" }, ...(this.view ? [this.view.canvas] : []));
    const lesson = step ? this.asking(step) : [];
    this.root.replaceChildren(view, element("div", { class: "hl-side" }, ...lesson, bar, this.notice, this.panel.root, link), this.plots.root, foot);
    void this.recode();
  }

  /** The prediction before the run, and the table of claims. */
  private asking(step: StepData): HTMLElement[] {
    const found: HTMLElement[] = [], { prediction } = step;
    if (prediction) {
      const box = element("fieldset", {}, element("legend", {}, prediction.question));
      if (prediction.kind === "choice") {
        const name = `hl-${Math.random().toString(36).slice(2)}`;
        const inputs = prediction.options!.map((option, k) => {
          const input = element("input", { type: "radio", name, value: String(k) });
          box.append(element("label", { class: "hl-check" }, input, option.text));
          return input;
        });
        this.guess = () => inputs.findIndex((each) => each.checked) < 0 ? null : inputs.findIndex((each) => each.checked);
      } else {
        const input = element("input", { type: "number", min: String(prediction.low), max: String(prediction.high), step: "any" });
        box.append(element("label", {}, input, ` ${prediction.measure.unit}`));
        this.guess = () => (input.value === "" ? null : Number(input.value));
      }
      found.push(box, this.answer);
    }
    this.claims = step.claims.map((claim) => element("li", {}, claim.text,
      claim.live ? "" : " (judged in himpc-lab only)"));
    const again = button(`Run the step (${step.scene.duration} s)`, () => void this.again());
    found.push(element("ul", { class: "hl-claims" }, ...this.claims), again);
    return found;
  }

  /** The step from its beginning, with its own settings. */
  private async again(): Promise<void> {
    const robot = unpacked<RobotData>(await unwrapped(`robot/${this.asked.robot}`));
    await this.opened([], robot.told);
    this.changes.clear();
    this.claims.forEach((each) => delete each.dataset.holds);
    this.raw.clear();
    this.running = false;
    this.toggle();
    void this.recode();
  }

  private judge(claims: number[], prediction: number): void {
    const show = (value: number, unit: string): string => (isFinite(value) ? `${Number(value.toPrecision(3))} ${unit}`.trim() : "–");
    this.step!.claims.forEach((claim, k) => {
      if (!claim.live) return;
      const good = holds(claim, claims[k]);
      this.claims[k].dataset.holds = String(good);
      this.claims[k].textContent = `${good ? "✓" : "✗"} ${claim.text} Measured: ${show(claims[k], claim.measure.unit)} (${claim.condition})`;
    });
    const asked = this.step!.prediction, guess = this.guess?.() ?? null;
    if (asked) {
      const number = show(prediction, asked.measure.unit);
      if (asked.kind === "choice") {
        const right = asked.options!.findIndex((each) => (each.low ?? -Infinity) <= prediction && prediction < (each.high ?? Infinity));
        this.answer.textContent = right < 0 ? "The run gave nothing to measure." :
          `${guess === right ? "Right" : "It was"}: ${asked.options![right].text} (${number}).`;
      } else this.answer.textContent = guess === null ? `It was ${number}.` : `You said ${show(guess, asked.measure.unit)}, it was ${number}.`;
    }
    this.say("The step is over and judged. Run goes on by hand: drag the target, change the settings.");
  }

  /** Where the target of a task is on the screen, in pixels; for tests. */
  pixel(task: string): [number, number] { return this.view!.pixel(task); }

  private say(words: string): void { this.notice.textContent = words; }

  private toggle(): void {
    this.running = !this.running;
    this.engine.say({ kind: this.running ? "run" : "pause" });
    this.run.textContent = this.running ? "Pause" : "Run";
  }

  private reset(): void {
    this.raw.clear();
    this.engine.say({ kind: "reset" });
  }

  private known(path: string, value: unknown): void {
    this.changes.set(path, value);
    const level = path.startsWith("levels.") && path.endsWith(".enabled") && this.scene.levels.find((each) => `levels.${each.name}.enabled` === path);
    if (level) level.enabled = value === true;
  }

  private set(path: string, value: unknown): void {
    this.say("");
    this.known(path, value);
    this.engine.say({ kind: "set", path, value });
    void this.recode();
  }

  private drag(task: string, place: number[]): void {
    this.raw.set(task, place);
    this.panel.aimed(task, place);
    this.engine.say({ kind: "target", task, value: place });
  }

  private state(): State {
    const changed = [...this.changes].map(([path, value]) => assignment(path, value)), { step } = this;
    const own = step ? [...step.set.filter((each) => !this.changes.has(each.slice(0, each.indexOf("=")))), ...changed] : changed;
    return { s: step ? step.scene_name : this.scene.name, ...(step?.robot_name ? { r: step.robot_name } : {}), ...(own.length ? { a: own } : {}),
      ...(step ? { l: step.lesson, p: Number(this.asked.step) } : {}) };
  }

  private async recode(): Promise<void> {
    this.code.value = await encode(this.state());
    if (this.asked.wide) history.replaceState(null, "", `#${this.changes.size ? this.code.value : this.scene.name}`);
  }

  private async copy(): Promise<void> {
    const link = `${location.href.split("#")[0]}#${this.code.value}`;
    try {
      await navigator.clipboard.writeText(link);
      this.say("The link is copied.");
    } catch {
      this.code.select();
      this.say("Copy the code from the field: this browser does not let a page copy.");
    }
  }

  private hear(message: ToPage): void {
    if (message.kind === "frame") this.show(message);
    else if (message.kind === "judged") this.judge(message.claims, message.prediction);
    else if (message.kind === "refused" || message.kind === "failed") this.say(`${message.words.replace(/^Error: /, "")}.`);
  }

  private show(frame: Frame): void {
    this.frame = frame;
    this.running = frame.running;
    this.run.textContent = frame.running ? "Pause" : "Run";
    this.view?.show(frame);
    this.plots.take(frame);
    this.panel.show(frame);
    for (const { task, kind, value } of frame.targets) {
      const at = this.placed(task);
      if (!at || kind !== "position") continue;
      const here = point(frame.poses, at), axes = this.axes(task);
      const filtered = here.map((own, a) => (axes.includes("xyz"[a]) ? value[axes.indexOf("xyz"[a])] : own));
      const raw = this.raw.get(task)?.map((own, a) => (axes.includes("xyz"[a]) ? own : here[a])) ?? filtered;
      if (!this.raw.has(task) && frame.restarted) this.panel.aimed(task, filtered);
      this.view?.place(task, filtered, raw);
    }
    const slow = frame.running && frame.speed < 0.97 ? ` · time runs at ${frame.speed.toFixed(2)} × here` : "";
    this.status.textContent = `t = ${frame.t.toFixed(2)} s${frame.running ? "" : " · paused"}${slow}` +
      `${frame.us ? ` · ${Math.round(frame.us)} µs a period` : ""} · binding: ${frame.binding.join(", ") || "nothing"}` +
      (frame.fallback === "solve" ? "" : ` · fallback: ${frame.fallback}`) + (frame.lost ? " · out of control: press Reset" : "");
  }
}

/** Where a point of a body is, m. */
function point(poses: Float32Array, at: { joint: number; pos: number[] }): number[] {
  if (!at.joint) return at.pos;
  const [x, y, z, w, i, j, k] = poses.subarray(7 * (at.joint - 1), 7 * at.joint), [a, b, c] = at.pos;
  const [tx, ty, tz] = [2 * (j * c - k * b), 2 * (k * a - i * c), 2 * (i * b - j * a)];
  return [x + a + w * tx + j * tz - k * ty, y + b + w * ty + k * tx - i * tz, z + c + w * tz + i * ty - j * tx];
}
