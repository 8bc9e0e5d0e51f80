/** The rows of a run, one per control period, and the measures of lessons/teaching/measure.py on them. */
import type { ClaimData, Field, MeasureData, SignalData } from "./data";

const KEPT = 60_000;
const AT_TORQUE = 1, AT_VELOCITY = 2, AT_POSITION = 4;
const CLOSE = (0.05 * Math.PI) / 180, NEAR = (5 * Math.PI) / 180, MOVED = Math.PI / 180;

export class Rows {
  private fields = new Map<string, [start: number, end: number]>();
  private rows: Float64Array[] = [];
  private width = 0;

  constructor(fields: Field[]) {
    for (const [name, , , width] of fields) this.fields.set(name, [this.width, (this.width += width)]);
  }

  get count(): number { return this.rows.length; }

  /** Adds a row, filled with NaN. */
  next(): void {
    if (this.count === KEPT) this.rows.splice(0, KEPT / 2);
    this.rows.push(new Float64Array(this.width).fill(NaN));
  }

  clear(): void { this.rows = []; }

  /** Returns the values of a field in a row; -1 is the last row. */
  at(row: number, name: string): Float64Array {
    const found = this.fields.get(name);
    if (!found) throw new Error(`this run has no ${name}`);
    return this.rows.at(row)!.subarray(...found);
  }
}

type OfRow = (rows: Rows, row: number) => number;
const finite = (value: number): number => (isFinite(value) ? value : 0);
const share = (value: string, bound: string): OfRow => (rows, row) => {
  const limits = rows.at(row, bound);
  return rows.at(row, value).reduce((most, each, a) => Math.max(most, finite(Math.abs(each) / limits[a])), 0);
};
const bit = (wanted: number): OfRow => (rows, row) =>
  rows.at(row, "at_bound").some((bits) => (finite(bits) & wanted) !== 0) ? 1 : 0;
/** Returns the largest value, over all joints, of a formula of the joint's velocity and its distance to the limit ahead. */
const towards = (formula: (v: number, left: number) => number): OfRow => (rows, row) => {
  const q = rows.at(row, "q"), low = rows.at(row, "q_lower"), high = rows.at(row, "q_upper");
  const found = rows.at(row, "v").map((v, a) => formula(v, Math.max(v > 0 ? high[a] - q[a] : q[a] - low[a], 0)));
  return found.reduce((most, each) => (isNaN(each) || each <= most ? most : each), NaN);
};

const DERIVED: Record<string, OfRow> = {
  "torque share": share("tau_demand", "tau_upper"),
  "speed share": share("v", "v_limit"),
  "position share": (rows, row) => {
    const low = rows.at(row, "q_lower"), high = rows.at(row, "q_upper");
    return rows.at(row, "q").reduce((most, q, a) =>
      Math.max(most, finite(Math.abs(q - 0.5 * (low[a] + high[a])) / (0.5 * (high[a] - low[a])))), 0);
  },
  "deceleration to stop": towards((v, left) => (left > CLOSE ? v ** 2 / (2 * left) : NaN)),
  "speed within 5° of an end": towards((v, left) => (left < NEAR ? Math.abs(v) : NaN)),
  "at a torque bound": bit(AT_TORQUE),
  "at a speed bound": bit(AT_VELOCITY),
  "at a position bound": bit(AT_POSITION),
  "joints moved": (rows, row) => {
    const start = rows.at(0, "q");
    return rows.at(row, "q").reduce((moved, q, a) => moved + (Math.abs(q - start[a]) > MOVED ? 1 : 0), 0);
  },
  "distance from the start": (rows, row) => {
    const start = rows.at(0, "x/position");
    return Math.hypot(...rows.at(row, "x/position").map((x, a) => x - start[a]));
  },
};

function signalAt({ name, factor, column }: SignalData, rows: Rows, row: number): number {
  if (name in DERIVED) return factor * DERIVED[name](rows, row);
  const found = rows.at(row, name);
  return factor * (found.length > 1 && column === null ? Math.hypot(...found) : found[column ?? 0]);
}

const sum = (values: number[]): number => values.reduce((total, each) => total + each, 0);
const STATISTICS: Record<string, (values: number[]) => number> = {
  largest: (values) => values.reduce((most, each) => Math.max(most, Math.abs(each)), 0),
  rms: (values) => Math.sqrt(sum(values.map((each) => each ** 2)) / values.length),
  mean: (values) => sum(values) / values.length,
  range: (values) => values.reduce((a, b) => Math.max(a, b)) - values.reduce((a, b) => Math.min(a, b)),
  last: (values) => sum(values) / values.length,
  sum,
};

const END = 0.05 - 1e-9; // s: "last" is a mean over this time

/** Returns the measured number up to now; NaN as long as there are no values. */
export function measured(measure: MeasureData, rows: Rows, ghost: Rows | null): number {
  const points: [number, number][] = [];
  for (let row = 0; row < rows.count; row++) {
    const t = rows.at(row, "t")[0], inside = t >= measure.after - 1e-9 && t < (measure.until ?? Infinity) - 1e-9;
    const value = inside ? signalAt(measure.signal, rows, row) : NaN;
    if (isFinite(value)) points.push([t, value]);
  }
  const from = measure.statistic === "last" && points.length ? points[points.length - 1][0] - END : -Infinity;
  const values = points.flatMap(([t, value]) => (t > from ? [value] : []));
  const own = values.length ? STATISTICS[measure.statistic](values) : NaN;
  if (!measure.over_ghost) return own;
  const other = ghost ? measured({ ...measure, over_ghost: false }, ghost, null) : NaN;
  return other ? own / other : NaN;
}

export const holds = (claim: ClaimData, value: number): boolean =>
  claim.relation === "at most" ? value <= claim.bound : value >= claim.bound;
