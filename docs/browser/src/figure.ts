/** One live figure: the simulation in its thread, the view, the plots, the controls and, in a lesson, the claims. */
import { assignment, encode, split } from "./code";
import { limit, unpacked, type Pack, type RobotData, type SceneData, type Scenes, type StepData } from "./data";
import { packed, type Engine } from "./engine";
import { AXES, Panel, button, element } from "./panel";
import { Plots } from "./plots";
import { holds } from "./rows";
import { View } from "./view";
import type { Frame, Told, Verdict } from "./worker";

declare global {
  interface Window { HIMPC_ABOUT: string; HIMPC_PACKS?: Record<string, string> }
}

export interface Asked {
  /** pack is "scene/NAME" or "lesson/NAME"; step is the number of the step, or null for a scene. */
  pack: string; robot: string; step: string | null; assignments: string[]; wide: boolean; running: boolean;
  /** Settled when the scripts of the simulation are loaded. The first picture needs only the scripts of robot and scene. */
  loaded: Promise<unknown>;
}

export class Figure {
  /** null in a browser without WebGL. */
  private view: View | null = null;
  private plots!: Plots;
  private panel!: Panel;
  private scenes!: Pack<Scenes>;
  private robot!: RobotData;
  private scene!: SceneData;
  private step: StepData | null = null;
  private changes = new Map<string, unknown>();
  private raw = new Map<string, number[]>();
  private status = element("p", { class: "hl-status" }, "Loading the controller and MuJoCo …");
  private notice = element("p", { class: "hl-notice", role: "status" });
  private run = button("Run", () => this.engine.tell(this.frame?.running ? "pause" : "run"));
  private code = element("input", { readOnly: true, type: "text", ariaLabel: "State code" });
  /** The frame that was shown last; tests read it. */
  frame: Frame | null = null;

  constructor(private root: HTMLElement, private engine: Engine, private asked: Asked) {}

  /** Draws the robot in its start pose. The robot moves as soon as MuJoCo and the kernel are compiled. */
  async open(): Promise<this> {
    const { asked, engine, drag } = this;
    const [pack, scenes] = await Promise.all([unpacked<RobotData>(packed(`robot/${asked.robot}`)), unpacked<Scenes>(packed(asked.pack))]);
    const { told } = this.scenes = scenes, robot = this.robot = pack.told;
    const step = this.step = asked.step === null ? null : told.steps![asked.step];
    const scene = this.scene = step ? step.scene : told.scene!;
    try {
      this.view = new View(pack, scene, drag);
    } catch {
      this.say("This browser has no WebGL, which the 3D view needs. Plots and controls work without the 3D view.");
    }
    for (const each of asked.assignments) this.changes.set(...split(each));
    this.plots = new Plots(scene.tasks, robot.joints.length);
    this.panel = new Panel(scene, { set: (path, value) => this.set(path, value), target: drag,
      push: (joint, force) => engine.tell("push", joint, force, 0.1) });
    this.panel.show({ ...scene, off: scene.levels.filter(({ enabled }) => !enabled).map(({ name }) => name) });
    engine.onTold = (told) => this.hear(told);
    const side = this.lay();
    await asked.loaded;
    await Promise.all([engine.load(), this.reopen(asked.assignments)]);
    const origin = (step?.ghost_told ?? "") + window.HIMPC_ABOUT.replace("@mujoco@", engine.mujoco);
    this.root.append(element("p", { class: "hl-small" }, origin));
    side.inert = false;
    if (asked.running) engine.tell("run");
    return this;
  }

  private reopen(assignments: string[]): Promise<void> {
    return this.engine.call("open", { scenes: this.scenes, robot: this.robot, step: this.asked.step, assignments });
  }

  private drag = (task: string, place: number[]): void => {
    this.raw.set(task, place);
    this.panel.aimed(task, place);
    this.engine.tell("target", task, place);
  };

  /** Builds the layout of the figure; returns the element with the controls, which is inert at first. */
  private lay(): HTMLElement {
    const { step, asked, root, view, plots } = this, reset = button("Reset", () => this.engine.tell("reset"));
    const link = element("div", { class: "hl-bar" }, button("Copy the link", () => this.copy()), this.code);
    const side = element("div", { class: "hl-side", inert: true }, ...(step ? this.asking(step) : []),
      element("div", { class: "hl-bar" }, this.run, reset, this.status), this.notice, this.panel.root, link);
    root.classList.add("hl-figure");
    root.classList.toggle("hl-wide", asked.wide);
    root.replaceChildren(element("div", { class: "hl-view" }, ...(view ? [view.canvas] : [])), side, plots.root);
    const mark = side.onscroll = (): void => {
      side.toggleAttribute("data-above", side.scrollTop > 1);
      side.toggleAttribute("data-below", side.scrollTop + side.clientHeight < side.scrollHeight - 1);
    };
    for (const each of [side, this.panel.root]) new ResizeObserver(mark).observe(each);
    void this.recode();
    return side;
  }

  /** Returns the controls of a step: the prediction, the list of claims, and the button that runs the step. */
  private asking({ asking }: StepData): Element[] {
    return [...element("div", { innerHTML: asking }).children,
      button("Run this step", () => void this.again())];
  }

  private get claims(): HTMLElement[] { return [...this.root.querySelectorAll<HTMLElement>(".hl-claims li")]; }

  /** The learner's prediction: the number of an option, or a value. */
  private get guess(): number | null {
    const given = this.root.querySelector<HTMLInputElement>(".hl-guess :is(:checked, [type=number])")?.value;
    return given ? Number(given) : null;
  }

  /** Runs the step from its beginning with its original settings. */
  private async again(): Promise<void> {
    await this.reopen([]);
    this.changes.clear();
    this.claims.forEach((each) => delete each.dataset.holds);
    this.engine.tell("run");
    void this.recode();
  }

  private judge({ claims, prediction }: Verdict): void {
    const number = (value: number, unit: string): string => (isFinite(value) ? `${Number(value.toPrecision(3))}${unit[0] === "°" ? "" : " "}${unit}`.trim() : "–");
    this.claims.forEach((line, k) => {
      const claim = this.step!.claims[k];
      if (!claim.live) return;
      const good = holds(claim, claims[k]), measured = number(claims[k], claim.measure.unit);
      line.dataset.holds = String(good);
      line.textContent = `${good ? "✓" : "✗"} ${claim.text} ${good ? measured : `false ${measured}, must be ${claim.condition}`}`;
    });
    const asked = this.step!.prediction, { guess } = this;
    if (asked) {
      const was = number(prediction, asked.measure.unit), { options } = asked;
      const right = options?.findIndex(({ low, high }) => limit(low, -1) <= prediction && prediction < limit(high)) ?? -1;
      const yours = guess === null || guess === right ? "" : options ? `${options[guess].text} (✗ your answer) · ` : `your guess ${number(guess, asked.measure.unit)} · `;
      this.root.querySelector(".hl-answer")!.textContent = !options ? `${yours}measured ${was}`
        : right < 0 ? "The run gave no measured value." : `${yours}${options[right].text} (✓ measured: ${was})`;
    }
    this.say("The step is over and its claims are judged. Press Run to continue: drag the target, or change the settings.");
  }

  /** Returns the position of a task's target on the screen, in pixels; tests use it. */
  pixel(task: string): [number, number] { return this.view!.pixel(task); }

  private say(words: string): void { this.notice.textContent = words; }

  private set(path: string, value: unknown): void {
    this.say("");
    this.changes.set(path, value);
    this.engine.tell("set", path, value);
    void this.recode();
  }

  private async recode(): Promise<void> {
    const changed = [...this.changes].map(([path, value]) => assignment(path, value)), { step, scene, asked } = this;
    const own = [...(step?.set ?? []).filter((each) => !this.changes.has(split(each)[0])), ...changed];
    this.code.value = await encode({ ...(step?.state ?? { s: scene.name }), ...(own.length ? { a: own } : {}) });
    if (asked.wide) history.replaceState(null, "", `#${this.changes.size ? this.code.value : scene.name}`);
  }

  private async copy(): Promise<void> {
    try {
      await navigator.clipboard.writeText(`${location.href.split("#")[0]}#${this.code.value}`);
      this.say("The link is copied.");
    } catch {
      this.code.select();
      this.say("Copy the code from the field: this browser does not allow pages to copy text.");
    }
  }

  private hear(told: Told): void {
    if ("error" in told) this.say(`${told.error.replace(/^Error: /, "")}.`);
    else if ("verdict" in told) this.judge(told.verdict);
    else this.show(told.frame);
  }

  private show(frame: Frame): void {
    this.frame = frame;
    if (frame.restarted) this.raw.clear();
    this.run.textContent = frame.running ? "Pause" : "Run";
    this.view?.show(frame);
    this.plots.take(frame);
    this.panel.show(frame);
    for (const { task, value } of frame.targets) {
      const { axes } = this.scene.tasks.find(({ name }) => name === task)!, raw = this.raw.get(task);
      if (!raw && frame.restarted) this.panel.aimed(task, AXES.map((axis) => value[axes.indexOf(axis)]));
      this.view?.place(task, value, raw);
    }
    const pace = frame.speed < 0.97 ? `slower than real time (${Number(frame.speed.toPrecision(1))} ×)` : "real time";
    this.status.textContent = (frame.running ? `Running · ${frame.t.toFixed(1)} s · ${pace}` : `Paused · ${frame.t.toFixed(3)} s`) +
      `${frame.us ? ` · ${Math.round(frame.us)} µs a period` : ""} · binding: ${frame.binding.join(", ") || "nothing"}` +
      (frame.fallback === "solve" ? "" : ` · fallback: ${frame.fallback}`) +
      (frame.lost ? " · out of control: press Reset" : "");
  }
}
