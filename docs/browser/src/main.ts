/** The functions that pages call: for a live figure in a lesson, and for the page Try it. */
import uPlotStyle from "uplot/dist/uPlot.min.css";
import { decode, encode } from "./code";
import { unpacked } from "./data";
import { Engine, packed } from "./engine";
import { Figure, type Asked } from "./figure";
import style from "./style.css";

// The first thread starts while the other scripts are loaded.
let engine: Engine | null = null, spare: Engine | null = new Engine(), shown: Figure | null = null;

/** Opens a figure in an element and ends the figure that was open on the page. */
async function open(root: HTMLElement, asked: Asked): Promise<Figure> {
  engine?.end();
  engine = spare ?? new Engine();
  spare = null;
  shown = new Figure(root, engine, asked);
  return shown.open();
}

document.head.append(Object.assign(document.createElement("style"), { textContent: uPlotStyle + style }));

const calm = (): boolean => matchMedia("(prefers-reduced-motion: reduce)").matches;
const HIMPC = { open, decode, encode, unpacked, packed, Engine, calm, get shown() { return shown; } };
declare global {
  interface Window { HIMPC: typeof HIMPC }
}
window.HIMPC = HIMPC;
