/** The controls, whose HTML docs/figures/controls.py writes, and the list of levels. */
import type { SceneData } from "./data";
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

type Control = HTMLInputElement | HTMLSelectElement;

const valueOf = ({ value, dataset: { log } }: Control): number =>
  Number((log ? Number(log) ** Number(value) : Number(value)).toPrecision(3));

function tell(slider: HTMLInputElement, value: number): void {
  slider.ariaValueText = `${Number(value.toPrecision(3))} ${slider.dataset.unit}`.trim();
  slider.nextElementSibling!.textContent = slider.ariaValueText;
}

export interface Acts {
  set(path: string, value: unknown): void;
  push(joint: number, force: number[]): void;
  target(task: string, place: number[]): void;
}

export class Panel {
  readonly root = element("div", { class: "hl-panel", oninput: ({ target }) => this.act(target as Control) });
  private shown = "";

  constructor(private scene: SceneData, private acts: Acts) {
    this.root.innerHTML = scene.controls;
    const [joint, along, force, push] = this.root.querySelectorAll<Control>("[name=push] :is(select, input, button)");
    push.onclick = () => acts.push(valueOf(joint), AXES.map((axis) => (axis === along.value ? valueOf(force) : 0)));
  }

  private act(control: Control): void {
    const { path, task } = control.dataset, value = valueOf(control);
    if (control.type === "range") tell(control as HTMLInputElement, value);
    if (path) this.acts.set(path, control.type === "checkbox" ? (control as HTMLInputElement).checked : value);
    if (!task) return;
    const sliders = new Map(this.aims(task).map((each) => [each.dataset.axis, valueOf(each)]));
    this.acts.target(task, AXES.map((axis) => sliders.get(axis) ?? 0));
  }

  /** Returns the sliders of a target. */
  private aims(task: string): HTMLInputElement[] {
    return [...this.root.querySelectorAll<HTMLInputElement>("[data-task]")].filter(({ dataset }) => dataset.task === task);
  }

  /** Shows on the sliders the position (m) to which a target was dragged. */
  aimed(task: string, place: number[]): void {
    for (const slider of this.aims(task)) {
      slider.valueAsNumber = place[AXES.indexOf(slider.dataset.axis!)];
      tell(slider, place[AXES.indexOf(slider.dataset.axis!)]);
    }
  }

  show({ horizon, order, off }: Pick<Frame, "horizon" | "order" | "off">): void {
    const N = this.root.querySelector<HTMLSelectElement>("[data-path=horizon]")!, shown = `${order.join()}|${off.join()}`;
    if (N.value !== String(horizon)) N.value = String(horizon);
    if (this.shown === shown) return;
    this.shown = shown;
    const { levels, controller } = this.scene, fixed = controller === "weighted", here = document.activeElement?.ariaLabel;
    this.root.querySelector("ol")!.replaceChildren(...order.map((name, place) => {
      const box = element("input", { type: "checkbox", checked: !off.includes(name), disabled: fixed });
      const mark = element("i", { class: "hl-mark" });
      mark.style.background = LEVELS[levels.findIndex((each) => each.name === name) % 6];
      box.dataset.path = `levels.${name}.enabled`;
      const move = (by: number, sign: string, words: string): HTMLButtonElement => {
        const to = order.with(place, order[place + by]);
        to[place + by] = name;
        const made = button(sign, () => this.acts.set("order", to.join(",")), `${name} ${words}`);
        made.disabled = fixed || !(place + by in order);
        return made;
      };
      return element("li", {}, element("label", { class: "hl-check" }, mark, box, name), move(-1, "▲", "up"), move(1, "▼", "down"));
    }));
    if (here) this.root.querySelector<HTMLElement>(`ol [aria-label="${here}"]`)?.focus();
  }
}
