/** The controls: native inputs, so that every one works with keys. */
import type { LevelData, Numbers, RobotData, SceneData, TaskData } from "./data";
import type { Frame } from "./worker";

export const LEVELS = ["#e27000", "#3079f0", "#258964", "#e700c6", "#ff2172", "#027d99"];
export const AXES = ["x", "y", "z"];

export function element<K extends keyof HTMLElementTagNameMap>(tag: K,
  { class: className = "", ...given }: Partial<HTMLElementTagNameMap[K]> & { class?: string } = {},
  ...children: (Node | string)[]): HTMLElementTagNameMap[K] {
  const made = Object.assign(document.createElement(tag), { className }, given);
  made.append(...children);
  return made;
}

export const button = (words: string, onclick: () => void, title = words): HTMLButtonElement =>
  element("button", { type: "button", title, onclick, ariaLabel: title === words ? null : title }, words);
const group = (title: string, open: boolean, ...children: Node[]): HTMLElement =>
  element("details", { open }, element("summary", {}, title), ...children);
export const boxed = (title: string, ...children: (Node | string)[]): HTMLElement =>
  element("fieldset", {}, element("legend", {}, title), ...children);
const small = (words: string): HTMLElement => element("p", { class: "hl-small" }, words);
const choice = (ariaLabel: string, options: [value: string, words: string][], value: string): HTMLSelectElement => {
  const made = element("select", { ariaLabel }, ...options.map(([value, words]) => element("option", { value }, words)));
  return Object.assign(made, { value });
};

/** A slider; on a logarithmic scale if `log`. */
class Slider {
  readonly root: HTMLElement;
  private input = element("input", { type: "range" });
  private shown = element("output");

  constructor(words: string, private unit: string, private low: number, private high: number, value: Numbers,
    private log: boolean, act: (value: number) => void = () => {}) {
    const [min, max] = [this.to(low), this.to(high)].map(String), step = String((this.to(high) - this.to(low)) / 200);
    Object.assign(this.input, { min, max, step, oninput: () => {
      this.tell();
      act(this.value);
    } });
    this.root = element("label", { class: "hl-slider" }, element("span", {}, words), this.input, this.shown);
    this.put([value].flat()[0]);
  }

  get value(): number { return Number((this.log ? 10 ** Number(this.input.value) : Number(this.input.value)).toPrecision(3)); }
  private to(value: number): number { return this.log ? Math.log10(value) : value; }
  private tell(value = this.value): void {
    this.shown.textContent = this.input.ariaValueText = `${Number(value.toPrecision(3))} ${this.unit}`.trim();
  }

  put(value: number): void {
    this.input.value = String(this.to(Math.min(Math.max(value, this.low), this.high)));
    this.tell(value);
  }
}

function checkbox(words: string, on: boolean, act: (on: boolean) => void): HTMLElement {
  const input = element("input", { type: "checkbox", checked: on, onchange: () => act(input.checked) });
  return element("label", { class: "hl-check" }, input, words);
}

export interface Acts {
  set(path: string, value: unknown): void;
  push(joint: number, force: number[]): void;
  target(task: string, place: number[]): void;
}

export class Panel {
  readonly root = element("div", { class: "hl-panel" });
  private list = element("ol", { class: "hl-levels" });
  private horizon: HTMLSelectElement;
  private strict: boolean;
  private targets = new Map<string, Map<string, Slider>>();
  private shown = "";

  constructor(private scene: SceneData, robot: RobotData, private acts: Acts, wide: boolean) {
    const { limits, plant } = scene, keys = Object.keys(scene.images), strict = this.strict = scene.controller !== "weighted";
    const horizons = [...new Set(keys.map((key) => Number(key.split("|")[0])))].sort((a, b) => a - b);
    const number = (path: string, words: string, unit: string, low: number, high: number, value: Numbers, log = false): HTMLElement =>
      new Slider(words, unit, low, high, value, log, (value) => acts.set(path, value)).root;
    const on = (path: string, words: string, value: boolean): HTMLElement => checkbox(words, value, (on) => acts.set(path, on));
    const targets = scene.tasks.filter(({ frame, target }) => frame && target === "position").map(({ name, axes }: TaskData) => {
      const aim = (): void => acts.target(name, AXES.map((axis) => made.get(axis)?.value ?? 0));
      const made = new Map([...axes].map((axis) => [axis, new Slider(axis, "m", -robot.reach, robot.reach, 0, false, aim)]));
      this.targets.set(name, made);
      return boxed(`Target of ${name}`, ...[...made.values()].map((each) => each.root));
    });
    const weights = ({ name, Q, R }: LevelData, level: number): HTMLElement => boxed(name,
      number(`levels.${name}.Q`, "Q", "", 1, 2000, Q, true),
      ...(strict ? [number(`levels.${name}.R`, "R", "", 0.1, 1000, R, true)] : []),
      ...scene.tasks.filter((task) => task.unit && task.level === level).flatMap((task) => [
        number(`tasks.${task.name}.K_p`, "K_P", "1/s²", 0, 400, task.K_p),
        number(`tasks.${task.name}.K_v`, "K_V", "1/s", 0, 60, task.K_v)]));
    this.horizon = choice("N", horizons.map((N) => [String(N), String(N)]), String(scene.horizon));
    this.horizon.onchange = () => acts.set("horizon", Number(this.horizon.value));
    const joint = choice("Pushed link", robot.joints.map((name, k) => [String(k + 1), `link ${k + 1} (${name})`]), String(robot.joints.length));
    const along = choice("Direction of the push", AXES.map((axis) => [axis, axis]), "x");
    const force = new Slider("Force", "N", -200, 200, 60, false);
    const push = (): void => acts.push(Number(joint.value), AXES.map((axis) => (axis === along.value ? force.value : 0)));
    this.root.append(
      group("Levels, highest priority first", true, this.list, small(!strict ?
        "This controller weighs all levels: none can be switched or moved." : keys.length > horizons.length ? "" :
        "This figure has one order of its levels only.")),
      ...(targets.length ? [group("Target", wide, ...targets)] : []),
      group("Controller", wide, element("label", { class: "hl-check" }, "N ", this.horizon),
        small(horizons.length > 1 ? "other N: in himpc-lab" : "one N only in this figure"),
        number("M_bar_scale", "M̄ scale", "×", 0.1, 8, scene.M_bar_scale, true)),
      group("Weights and gains", false, ...scene.levels.map(weights)),
      group("Limits", false, on("limits.torque", "torque", limits.torque),
        number("limits.torque_scale", "scale", "×", 0.05, 2, limits.torque_scale, true),
        on("limits.velocity", "velocity", limits.velocity),
        number("limits.velocity_scale", "scale", "×", 0.05, 2, limits.velocity_scale, true)),
      group("Robot", wide, number("plant.payload_kg", "Payload", "kg", 0, 10, plant.payload_kg),
        number("plant.friction", "Friction", "N·m", 0, 10, plant.friction), on("plant.gravity", "gravity", plant.gravity),
        boxed("Push for 0.1 s", "at ", joint, " along ", along, force.root, button("Push", push))),
    );
  }

  /** Where a target was dragged to. */
  aimed(task: string, place: number[]): void {
    this.targets.get(task)?.forEach((slider, axis) => slider.put(place[AXES.indexOf(axis)]));
  }

  show({ horizon, order, off }: Pick<Frame, "horizon" | "order" | "off">): void {
    if (this.horizon.value !== String(horizon)) this.horizon.value = String(horizon);
    const shown = `${order.join()}|${off.join()}`;
    if (this.shown === shown) return;
    this.shown = shown;
    const { levels, images } = this.scene, here = document.activeElement?.ariaLabel;
    this.list.replaceChildren(...order.map((name, place) => {
      const index = levels.findIndex((each) => each.name === name), mark = element("i", { class: "hl-mark" });
      const box = checkbox(name, !off.includes(name), (on) => this.acts.set(`levels.${name}.enabled`, on));
      box.querySelector("input")!.disabled = !this.strict;
      mark.style.background = LEVELS[index % 6];
      box.prepend(mark);
      const move = (by: number, sign: string, words: string): HTMLButtonElement => {
        const to = order.with(place, order[place + by]);
        to[place + by] = name;
        const made = button(sign, () => this.acts.set("order", to.join(",")), `${name} ${words}`);
        made.disabled = !this.strict || !(place + by in order) || !(`${horizon}|${to.join(",")}` in images);
        return made;
      };
      return element("li", {}, box, move(-1, "▲", "up"), move(1, "▼", "down"));
    }));
    if (here) this.list.querySelector<HTMLElement>(`[aria-label="${here}"]`)?.focus();
  }
}
