/** One live figure: the simulation in its thread, the view, the plots, the controls and, in a lesson, the claims. */
import { assignment, encode, split, type State } from "./code";
import { unpacked, type RobotData, type SceneData, type StepData, type TaskData } from "./data";
import { packed, type Engine } from "./engine";
import type { Frame, Verdict } from "./messages";
import { LEVELS, Panel, button, element } from "./panel";
import { Plots } from "./plots";
import { holds } from "./rows";
import { View } from "./view";

export interface About { version: string; commit: string; kernel: string; mujoco: string }
declare global {
  interface Window { HIMPC_ABOUT: About; HIMPC_PACKS?: Record<string, string> }
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
  private robot!: RobotData;
  private scene!: SceneData;
  private step: StepData | null = null;
  private tasks = new Map<string, TaskData>();
  private colours = new Map<string, string>();
  private changes = new Map<string, unknown>();
  private raw = new Map<string, number[]>();
  private running = false;
  private status = element("p", { class: "hl-status" });
  private notice = element("p", { class: "hl-notice", role: "status" });
  private run = button("Run", () => this.toggle());
  private code = element("input", { readOnly: true, type: "text", ariaLabel: "State code" });
  private guess: () => number | null = () => null;
  private claims: HTMLElement[] = [];
  private answer = element("p", { class: "hl-answer" });
  /** The last moment that was shown; for tests. */
  frame: Frame | null = null;

  constructor(private root: HTMLElement, private engine: Engine, private asked: Asked) {}

  async open(): Promise<this> {
    // The page prepares the picture while the thread compiles MuJoCo.
    const { asked, engine } = this, loaded = engine.load(), pack = await unpacked<RobotData>(packed(`robot/${asked.robot}`));
    const robot = this.robot = pack.told, opened = this.opened(asked.assignments);
    const drag = (task: string, place: number[]): void => {
      this.raw.set(task, place);
      this.panel.aimed(task, place);
      engine.tell("target", task, place);
    };
    try {
      this.view = new View(pack, drag);
    } catch {
      this.say("This browser has no WebGL, which the 3D view needs: plots and controls work without it.");
    }
    const [{ scene, step, tasks }] = await Promise.all([opened, loaded]);
    [this.scene, this.step] = [scene, step];
    for (const each of asked.assignments) this.known(...split(each));
    scene.levels.forEach((level, k) => level.tasks.forEach((task) => {
      this.tasks.set(task.name, task);
      this.colours.set(task.name, LEVELS[k % 6]);
    }));
    const draggable = tasks.filter(({ name, target }) => this.tasks.get(name)!.frame && target === "position")
      .map(({ name }) => ({ task: name, axes: this.tasks.get(name)!.axes }));
    this.plots = new Plots(tasks.map((task) => ({ ...task, colour: this.colours.get(task.name)! })), robot.joints.length);
    this.panel = new Panel(scene, robot, { set: (path, value) => this.set(path, value), target: drag,
      push: (joint, force) => engine.tell("push", joint, force, 0.1) }, draggable, asked.wide);
    engine.onFrame = (frame) => this.show(frame);
    engine.onVerdict = (verdict) => this.judge(verdict);
    engine.onError = (words) => this.say(`${words.replace(/^Error: /, "")}.`);
    this.lay();
    if (asked.running) this.toggle();
    return this;
  }

  private opened(assignments: string[]) {
    const { pack, step } = this.asked;
    return this.engine.call("open", { scenes: packed(pack), robot: this.robot, step, assignments });
  }

  private lay(): void {
    const { step, asked, engine, root } = this, about = window.HIMPC_ABOUT;
    const bar = element("div", { class: "hl-bar" }, this.run, button("Reset", () => this.reset()), this.status);
    const link = element("div", { class: "hl-bar" }, button("Copy the link", () => this.copy()), this.code);
    const ghost = !step?.ghost_words ? "" : step.ghost ? `Violet: the ghost, ${step.ghost_words}. ` :
      `The ghost (${step.ghost_words}) runs in himpc-lab only: ${step.ghost_missing}. `;
    const foot = element("p", { class: "hl-small" }, `${ghost}Kernel ${about.kernel} of himpc-lab ${about.version}, ` +
      `commit ${about.commit}, as WebAssembly; the robot is simulated by MuJoCo ${engine.mujoco}, in himpc-lab by ` +
      `${about.mujoco}. Unlike himpc-lab this page has no controllers that need Python (OSF, HQP, HTMPC), no tasks to add, ` +
      "no recordings and no QP drawings, and three rare fallbacks are missing. " +
      "The code opens in himpc-lab: himpc-lab --state CODE.");
    root.classList.add("hl-figure");
    root.classList.toggle("hl-wide", asked.wide);
    const view = element("div", { class: "hl-view" }, ...(this.view ? [this.view.canvas] : []));
    const side = element("div", { class: "hl-side" }, ...(step ? this.asking(step) : []), bar, this.notice, this.panel.root, link);
    root.replaceChildren(view, side, this.plots.root, foot);
    void this.recode();
  }

  /** The prediction before the run, and the table of claims. */
  private asking({ prediction, claims, scene }: StepData): HTMLElement[] {
    const found: HTMLElement[] = [];
    if (prediction) {
      const box = element("fieldset", {}, element("legend", {}, prediction.question));
      if (prediction.kind === "choice") {
        const name = `hl-${Math.random().toString(36).slice(2)}`;
        const inputs = prediction.options!.map(() => element("input", { type: "radio", name }));
        box.append(...inputs.map((each, k) => element("label", { class: "hl-check" }, each, prediction.options![k].text)));
        this.guess = () => inputs.findIndex((each) => each.checked);
      } else {
        const input = element("input", { type: "number", min: String(prediction.low), max: String(prediction.high), step: "any" });
        box.append(element("label", {}, input, ` ${prediction.measure.unit}`));
        this.guess = () => (input.value === "" ? null : Number(input.value));
      }
      found.push(box, this.answer);
    }
    this.claims = claims.map(({ text, live }) => element("li", {}, text, live ? "" : " (judged in himpc-lab only)"));
    return [...found, element("ul", { class: "hl-claims" }, ...this.claims),
      button(`Run the step (${scene.duration} s)`, () => void this.again())];
  }

  /** The step from its beginning, with its own settings. */
  private async again(): Promise<void> {
    await this.opened([]);
    this.changes.clear();
    this.claims.forEach((each) => delete each.dataset.holds);
    this.raw.clear();
    this.running = false;
    this.toggle();
    void this.recode();
  }

  private judge({ claims, prediction }: Verdict): void {
    const number = (value: number, unit: string): string => (isFinite(value) ? `${Number(value.toPrecision(3))} ${unit}`.trim() : "–");
    this.step!.claims.forEach((claim, k) => {
      if (!claim.live) return;
      const good = holds(claim, claims[k]), measured = number(claims[k], claim.measure.unit);
      this.claims[k].dataset.holds = String(good);
      this.claims[k].textContent = `${good ? "✓" : "✗"} ${claim.text} Measured: ${measured} (${claim.condition})`;
    });
    const asked = this.step!.prediction, guess = this.guess();
    if (asked) {
      const was = number(prediction, asked.measure.unit), options = asked.options ?? [];
      const right = options.findIndex(({ low, high }) => (low ?? -Infinity) <= prediction && prediction < (high ?? Infinity));
      this.answer.textContent = asked.kind === "choice" ? right < 0 ? "The run gave nothing to measure." :
        `${guess === right ? "Right" : "It was"}: ${options[right].text} (${was}).` :
        guess === null ? `It was ${was}.` : `You said ${number(guess, asked.measure.unit)}, it was ${was}.`;
    }
    this.say("The step is over and judged. Run goes on by hand: drag the target, change the settings.");
  }

  /** Where the target of a task is on the screen, in pixels; for tests. */
  pixel(task: string): [number, number] { return this.view!.pixel(task); }

  private say(words: string): void { this.notice.textContent = words; }

  private toggle(): void {
    this.running = !this.running;
    this.engine.tell(this.running ? "run" : "pause");
    this.run.textContent = this.running ? "Pause" : "Run";
  }

  private reset(): void {
    this.raw.clear();
    this.engine.tell("reset");
  }

  private known(path: string, value: unknown): void {
    this.changes.set(path, value);
    const level = this.scene.levels.find(({ name }) => `levels.${name}.enabled` === path);
    if (level) level.enabled = value === true;
  }

  private set(path: string, value: unknown): void {
    this.say("");
    this.known(path, value);
    this.engine.tell("set", path, value);
    void this.recode();
  }

  private state(): State {
    const changed = [...this.changes].map(([path, value]) => assignment(path, value)), { step } = this;
    const own = [...(step?.set ?? []).filter((each) => !this.changes.has(split(each)[0])), ...changed];
    return { s: step ? step.scene_name : this.scene.name, ...(step?.robot_name ? { r: step.robot_name } : {}),
      ...(own.length ? { a: own } : {}), ...(step ? { l: step.lesson, p: Number(this.asked.step) } : {}) };
  }

  private async recode(): Promise<void> {
    this.code.value = await encode(this.state());
    if (this.asked.wide) history.replaceState(null, "", `#${this.changes.size ? this.code.value : this.scene.name}`);
  }

  private async copy(): Promise<void> {
    try {
      await navigator.clipboard.writeText(`${location.href.split("#")[0]}#${this.code.value}`);
      this.say("The link is copied.");
    } catch {
      this.code.select();
      this.say("Copy the code from the field: this browser does not let a page copy.");
    }
  }

  private show(frame: Frame): void {
    this.frame = frame;
    this.running = frame.running;
    this.run.textContent = frame.running ? "Pause" : "Run";
    this.view?.show(frame);
    this.plots.take(frame);
    this.panel.show(frame);
    for (const { task, kind, value } of frame.targets) {
      const { frame: at, axes } = this.tasks.get(task) ?? { frame: null, axes: "" };
      if (!at || kind !== "position") continue;
      const here = point(frame.poses, at), place = [..."xyz"].map((axis) => axes.indexOf(axis));
      const filtered = here.map((own, a) => (place[a] < 0 ? own : value[place[a]]));
      const raw = this.raw.get(task)?.map((own, a) => (place[a] < 0 ? here[a] : own)) ?? filtered;
      if (!this.raw.has(task) && frame.restarted) this.panel.aimed(task, filtered);
      this.view?.place(task, this.colours.get(task)!, filtered, raw);
    }
    const slow = frame.running && frame.speed < 0.97 ? ` · time runs at ${frame.speed.toFixed(2)} × here` : "";
    this.status.textContent = `t = ${frame.t.toFixed(2)} s${frame.running ? "" : " · paused"}${slow}` +
      `${frame.us ? ` · ${Math.round(frame.us)} µs a period` : ""} · binding: ${frame.binding.join(", ") || "nothing"}` +
      (frame.fallback === "solve" ? "" : ` · fallback: ${frame.fallback}`) +
      (frame.lost ? " · out of control: press Reset" : "");
  }
}

/** Where a point of a body is, m. */
function point(poses: Float32Array, at: { joint: number; pos: number[] }): number[] {
  if (!at.joint) return at.pos;
  const [x, y, z, w, i, j, k] = poses.subarray(7 * (at.joint - 1), 7 * at.joint), [a, b, c] = at.pos;
  const [tx, ty, tz] = [2 * (j * c - k * b), 2 * (k * a - i * c), 2 * (i * b - j * a)];
  return [x + a + w * tx + j * tz - k * ty, y + b + w * ty + k * tx - i * tz, z + c + w * tz + i * ty - j * tx];
}
