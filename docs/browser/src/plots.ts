/** Errors of the tasks, and torques and velocities within their bounds, over the last seconds. */
import uPlot from "uplot";
import type { Frame } from "./messages";

const WINDOW_S = 8;
const JOINTS = ["#d72626", "#e27000", "#258964", "#027d99", "#3079f0", "#e700c6", "#ff2172"];

interface Drawn { plot: uPlot; data: number[][]; first: number; count: number; factors: number[] }

export class Plots {
  readonly root = document.createElement("div");
  private drawn: Drawn[] = [];
  private stale = 0;

  constructor(tasks: { name: string; unit: string; colour: string }[], joints: number) {
    this.root.className = "hl-plots";
    const factor = (unit: string): number => (unit === "m" ? 1e3 : 180 / Math.PI);
    const names = Array.from({ length: joints }, (_, k) => `joint ${k + 1}`), colours = names.map((_, k) => JOINTS[k % 7]);
    this.add("Errors of the tasks, mm and °", tasks.map((each) => `${each.name}, ${each.unit === "m" ? "mm" : "°"}`),
      tasks.map((each) => each.colour), 1, tasks.map((each) => factor(each.unit)), false);
    this.add("Torques, % of their bounds", names, colours, 1 + tasks.length, names.map(() => 100), true);
    this.add("Velocities, % of their bounds", names, colours, 1 + tasks.length + joints, names.map(() => 100), true);
    new ResizeObserver(() => this.resize()).observe(this.root);
  }

  private add(title: string, names: string[], colours: string[], first: number, factors: number[], bounded: boolean): void {
    const box = document.createElement("figure"), words = document.createElement("figcaption");
    words.textContent = title;
    box.setAttribute("role", "group");
    box.setAttribute("aria-label", title);
    const legend = document.createElement("p");
    legend.className = "hl-legend";
    legend.append(...names.flatMap((name, k) => {
      const mark = document.createElement("i"), text = document.createElement("span");
      mark.style.background = colours[k];
      text.append(mark, name);
      return [text, " "];
    }));
    const style = getComputedStyle(document.body), ink = style.color, grid = { stroke: "rgba(128,128,128,.25)", width: 1 };
    const axis = { stroke: ink, grid, ticks: grid, font: "11px sans-serif" };
    const lines = bounded ? [100, -100] : [];
    const plot = new uPlot({
      width: 320, height: 150, legend: { show: false }, cursor: { show: false }, padding: [6, 6, 0, 0],
      scales: { x: { time: false }, y: bounded ? { range: (_, low, high) => [Math.min(-110, low), Math.max(110, high)] } :
        { range: (_, __, high) => [0, Math.max(1e-3, 1.1 * high)] } },
      axes: [{ ...axis, size: 26 }, { ...axis, size: 46 }],
      series: [{}, ...names.map((name, k) => ({ label: name, stroke: colours[k], width: 1.5, points: { show: false } })),
        ...lines.map((value) => ({ label: `${value} %`, stroke: "#8b95a1", width: 1.5, dash: [6, 4], points: { show: false } }))],
    }, [[], ...names.map(() => []), ...lines.map(() => [])] as unknown as uPlot.AlignedData, box);
    box.prepend(words);
    box.append(legend);
    this.root.append(box);
    this.drawn.push({ plot, data: [[], ...names.map((): number[] => []), ...lines.map((): number[] => [])], first, count: names.length, factors });
  }

  clear(): void {
    for (const each of this.drawn) for (const column of each.data) column.length = 0;
  }

  take(frame: Frame): void {
    if (frame.restarted) this.clear();
    const { curves, width } = frame;
    for (const { data, first, count, factors } of this.drawn) {
      for (let at = 0; at < curves.length; at += width) {
        data[0].push(curves[at]);
        for (let k = 0; k < count; k++) data[1 + k].push(factors[k] * curves[at + first + k]);
        for (let k = 1 + count; k < data.length; k++) data[k].push(k === 1 + count ? 100 : -100);
      }
      const old = data[0].findIndex((t) => t >= frame.t - WINDOW_S);
      if (old > 0) for (const column of data) column.splice(0, old);
    }
    // A plot is drawn at every third frame: the eye sees no more of a curve that moves.
    if (this.stale++ % 3 === 0 || !frame.running) for (const { plot, data } of this.drawn) plot.setData(data as unknown as uPlot.AlignedData);
  }

  private resize(): void {
    for (const { plot } of this.drawn) {
      const width = plot.root.parentElement!.clientWidth;
      if (width && width !== plot.width) plot.setSize({ width, height: 150 });
    }
  }
}
