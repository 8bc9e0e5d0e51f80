/** Errors of the tasks, and torques and velocities within their bounds, over the last seconds. */
import uPlot from "uplot";
import type { TaskData } from "./data";
import { element, LEVELS } from "./panel";
import type { Frame } from "./worker";

const WINDOW_S = 8;
const JOINTS = ["#d72626", "#96661c", "#6f7f00", "#8257e6", "#77808c", "#b5528f", "#4f8a8b"]; // none is a level's
const LEAST = 1e-2; // mm or °: the axis of the errors is at least this long; its labels have three decimals

interface Line { label: string; stroke: string; factor: number }

export class Plots {
  readonly root = element("div", { class: "hl-plots" });
  private drawn: { plot: uPlot; data: number[][]; first: number; lines: Line[] }[] = [];
  private frames = 0;

  constructor(tasks: TaskData[], joints: number) {
    const errors = tasks.map(({ name, unit, level }) => ({ label: `${name} [${unit === "m" ? "mm" : "°"}]`,
      stroke: LEVELS[level % 6], factor: unit === "m" ? 1e3 : 180 / Math.PI }));
    const shares = Array.from({ length: joints }, (_, k) => ({ label: `joint ${k + 1}`, stroke: JOINTS[k % 7], factor: 100 }));
    this.add("Error per task, mm or °", 1, errors, (_, __, high) => [0, Math.max(LEAST, 1.1 * high)]);
    for (const [k, what] of ["Torques", "Velocities"].entries())
      this.add(`${what}, % of their bounds`, 1 + tasks.length + k * joints, shares,
        (_, low, high) => [Math.min(-110, low), Math.max(110, high)], [100, -100]);
    new ResizeObserver(() => this.drawn.forEach(({ plot }) => {
      const width = plot.root.parentElement!.clientWidth;
      if (width && width !== plot.width) plot.setSize({ width, height: 150 });
    })).observe(this.root);
  }

  private add(title: string, first: number, lines: Line[], range: uPlot.Range.Function, bounds: number[] = []): void {
    const box = element("figure", { role: "group", ariaLabel: title }, element("figcaption", {}, title));
    const grid = { stroke: "rgba(128,128,128,.25)", width: 1 };
    const axis = { stroke: getComputedStyle(document.body).color, grid, ticks: grid, font: "11px sans-serif" };
    const ends = bounds.map((end) => ({ label: `${end} %`, stroke: "#8b95a1", dash: [6, 4] }));
    const data: number[][] = [[], ...lines.map(() => []), ...bounds.map(() => [])];
    const plot = new uPlot({
      width: 320, height: 150, legend: { live: false }, cursor: { show: false }, padding: [6, 6, 0, 0],
      scales: { x: { time: false }, y: { range } }, axes: [{ ...axis, size: 26 }, { ...axis, size: 46 }],
      series: [{}, ...[...lines, ...ends].map((each) => ({ ...each, width: 1.5, points: { show: false } }))],
    }, data as uPlot.AlignedData, box);
    this.root.append(box);
    this.drawn.push({ plot, data, first, lines });
  }

  take({ curves, width, restarted, running, t }: Frame): void {
    // Plots are drawn at every third frame, as a higher rate is not visible in a moving curve.
    const redrawn = this.frames++ % 3 === 0 || !running;
    for (const { plot, data, first, lines } of this.drawn) {
      if (restarted) for (const column of data) column.length = 0;
      for (let at = 0; at < curves.length; at += width) {
        const shown = lines.map(({ factor }, k) => factor * curves[at + first + k]);
        [curves[at], ...shown, 100, -100].slice(0, data.length).forEach((value, k) => data[k].push(value));
      }
      const old = data[0].findIndex((each) => each >= t - WINDOW_S);
      for (const column of data) column.splice(0, Math.max(old, 0));
      if (redrawn) plot.setData(data as uPlot.AlignedData);
    }
  }
}
