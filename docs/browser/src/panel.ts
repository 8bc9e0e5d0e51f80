/** The controls: native inputs, so that every one works with keys. */
import type { Frame } from "./messages";
import type { LevelData, RobotData, SceneData } from "./data";

export const LEVELS = ["#e27000", "#3079f0", "#258964", "#e700c6", "#ff2172", "#027d99"];

export function element<K extends keyof HTMLElementTagNameMap>(tag: K, options: Partial<HTMLElementTagNameMap[K]> & { class?: string } = {},
  ...children: (Node | string)[]): HTMLElementTagNameMap[K] {
  const { class: name, ...given } = options, made = document.createElement(tag);
  Object.assign(made, given);
  if (name) made.className = name;
  made.append(...children);
  return made;
}

export const button = (words: string, act: () => void, title = words): HTMLButtonElement => {
  const made = element("button", { type: "button", title, onclick: act }, words);
  if (title !== words) made.setAttribute("aria-label", title);
  return made;
};

export interface Slider { root: HTMLElement; put(value: number): void }

/** A slider; on a logarithmic scale if `log`. */
export function slider(words: string, unit: string, low: number, high: number, value: number, log: boolean,
  act: (value: number) => void): Slider {
  const to = (each: number): number => (log ? Math.log10(each) : each), from = (each: number): number => (log ? 10 ** each : each);
  const round = (each: number): number => Number(each.toPrecision(3));
  const input = element("input", { type: "range", min: String(to(low)), max: String(to(high)), step: "any" });
  input.step = String((to(high) - to(low)) / 200);
  const shown = element("output"), root = element("label", { class: "hl-slider" }, element("span", {}, words), input, shown);
  const tell = (each: number): void => {
    shown.textContent = `${round(each)} ${unit}`.trim();
    input.setAttribute("aria-valuetext", shown.textContent);
  };
  const put = (each: number): void => {
    input.value = String(to(Math.min(Math.max(each, low), high)));
    tell(each);
  };
  input.oninput = () => {
    tell(from(Number(input.value)));
    act(round(from(Number(input.value))));
  };
  put(value);
  return { root, put };
}

export function checkbox(words: string, on: boolean, act: (on: boolean) => void): HTMLElement {
  const input = element("input", { type: "checkbox", checked: on });
  input.onchange = () => act(input.checked);
  return element("label", { class: "hl-check" }, input, words);
}

const group = (title: string, open: boolean, ...children: Node[]): HTMLDetailsElement =>
  element("details", { open }, element("summary", {}, title), ...children);
const first = (value: number | number[]): number => (typeof value === "number" ? value : value[0]);

export interface Acts {
  set(path: string, value: unknown): void;
  push(joint: number, force: number[]): void;
  target(task: string, place: number[]): void;
}

export class Panel {
  readonly root = element("div", { class: "hl-panel" });
  private list = element("ol", { class: "hl-levels" });
  private horizon = element("select");
  private sliders = new Map<string, Slider[]>();
  private order: string[] = [];
  private axes: Map<string, string>;

  constructor(private scene: SceneData, robot: RobotData, private acts: Acts, draggable: { task: string; axes: string }[], wide: boolean) {
    const strict = scene.controller !== "weighted", { limits, plant } = scene, keys = Object.keys(scene.images);
    const horizons = [...new Set(keys.map((key) => Number(key.split("|")[0])))].sort((a, b) => a - b);
    const set = acts.set;
    const reach = robot.bodies.reduce((total, body) => total + Math.hypot(...body.pos), 0);
    const targets = draggable.map(({ task, axes }) => {
      const made = [...axes].map((axis) => slider(`${axis}`, "m", -reach, reach, 0, false, () => this.aim(task)));
      this.sliders.set(task, made);
      return element("fieldset", {}, element("legend", {}, `Target of ${task}`), ...made.map((each) => each.root));
    });
    this.axes = new Map(draggable.map(({ task, axes }) => [task, axes]));
    const weights = (level: LevelData): HTMLElement => element("fieldset", {}, element("legend", {}, level.name),
      slider("Q", "", 1, 2000, first(level.Q), true, (value) => set(`levels.${level.name}.Q`, value)).root,
      ...(strict ? [slider("R", "", 0.1, 1000, first(level.R), true, (value) => set(`levels.${level.name}.R`, value)).root] : []),
      ...level.tasks.flatMap((task) => task.unit ? [
        slider("K_P", "1/s²", 0, 400, first(task.K_p), false, (value) => set(`tasks.${task.name}.K_p`, value)).root,
        slider("K_V", "1/s", 0, 60, first(task.K_v), false, (value) => set(`tasks.${task.name}.K_v`, value)).root] : []));
    horizons.forEach((N) => this.horizon.append(element("option", { value: String(N) }, String(N))));
    this.horizon.value = String(scene.horizon);
    this.horizon.setAttribute("aria-label", "N");
    this.horizon.onchange = () => set("horizon", Number(this.horizon.value));
    const orders = keys.length > horizons.length;
    const joint = element("select"), force = slider("Force", "N", -200, 200, 60, false, () => {});
    robot.joints.forEach((name, k) => joint.append(element("option", { value: String(k + 1), selected: k === robot.joints.length - 1 }, `link ${k + 1} (${name})`)));
    joint.setAttribute("aria-label", "Pushed link");
    const along = element("select", {}, ...["x", "y", "z"].map((axis) => element("option", { value: axis }, axis)));
    along.setAttribute("aria-label", "Direction of the push");
    const shove = (): void => {
      const size = Number(force.root.querySelector("input")!.value);
      acts.push(Number(joint.value), ["x", "y", "z"].map((axis) => (axis === along.value ? size : 0)));
    };
    this.root.append(
      group("Levels, highest priority first", true, this.list, element("p", { class: "hl-small" }, !strict ?
        "This controller weighs all levels: none can be switched or moved." : orders ? "" : "This figure has one order of its levels only.")),
      ...(targets.length ? [group("Target", wide, ...targets)] : []),
      group("Controller", wide, element("label", { class: "hl-check" }, "N ", this.horizon),
        element("span", { class: "hl-small" }, horizons.length > 1 ? " other N: in himpc-lab" : " one N only in this figure"),
        slider("M̄ scale", "×", 0.1, 8, scene.M_bar_scale, true, (value) => set("M_bar_scale", value)).root),
      group("Weights and gains", false, ...scene.levels.map(weights)),
      group("Limits", false, checkbox("torque", limits.torque, (on) => set("limits.torque", on)),
        slider("scale", "×", 0.05, 2, limits.torque_scale, true, (value) => set("limits.torque_scale", value)).root,
        checkbox("velocity", limits.velocity, (on) => set("limits.velocity", on)),
        slider("scale", "×", 0.05, 2, limits.velocity_scale, true, (value) => set("limits.velocity_scale", value)).root),
      group("Robot", wide, slider("Payload", "kg", 0, 10, plant.payload_kg, false, (value) => set("plant.payload_kg", value)).root,
        slider("Friction", "N·m", 0, 10, first(plant.friction), false, (value) => set("plant.friction", value)).root,
        checkbox("gravity", plant.gravity, (on) => set("plant.gravity", on)),
        element("fieldset", {}, element("legend", {}, "Push for 0.1 s"), "at ", joint, " along ", along,
          force.root, button("Push", shove))),
    );
  }

  private aim(task: string): void {
    const values = this.sliders.get(task)!.map((each) => Number(each.root.querySelector("input")!.value)), axes = this.axes.get(task)!;
    this.acts.target(task, ["x", "y", "z"].map((axis) => values[axes.indexOf(axis)] ?? 0));
  }

  /** Where a target was dragged to. */
  aimed(task: string, place: number[]): void {
    const axes = this.axes.get(task) ?? "";
    this.sliders.get(task)?.forEach((each, k) => each.put(place["xyz".indexOf(axes[k])]));
  }

  show(frame: Frame): void {
    if (this.horizon.value !== String(frame.horizon)) this.horizon.value = String(frame.horizon);
    if (this.order.join() === frame.order.join()) return;
    this.order = frame.order;
    const strict = this.scene.controller !== "weighted", names = this.scene.levels.map((level) => level.name);
    const here = document.activeElement?.getAttribute("aria-label");
    this.list.replaceChildren(...frame.order.map((name, place) => {
      const level = this.scene.levels[names.indexOf(name)], box = checkbox(name, level.enabled, (on) => {
        level.enabled = on;
        this.acts.set(`levels.${name}.enabled`, on);
      });
      (box.querySelector("input") as HTMLInputElement).disabled = !strict;
      box.prepend(element("i", { class: "hl-mark", style: `background:${LEVELS[names.indexOf(name) % 6]}` } as never));
      const move = (by: number): HTMLButtonElement => {
        const to = [...frame.order];
        to.splice(place + by, 0, ...to.splice(place, 1));
        const made = button(by < 0 ? "▲" : "▼", () => this.acts.set("order", to.join(",")), `${name} ${by < 0 ? "up" : "down"}`);
        made.disabled = !strict || !to.every(Boolean) || place + by < 0 || place + by >= to.length || !(`${frame.horizon}|${to.join(",")}` in this.scene.images);
        return made;
      };
      return element("li", {}, box, move(-1), move(1));
    }));
    if (here) (this.list.querySelector(`[aria-label="${here}"]`) as HTMLElement | null)?.focus();
  }
}
