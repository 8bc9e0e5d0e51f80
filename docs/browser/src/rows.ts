/** The rows of a run, one per control period, and numbers about them: lessons/teaching/measure.py. */
import type { ClaimData, MeasureData, SignalData } from "./data";

const KEPT = 60_000;
const AT_TORQUE = 1, AT_VELOCITY = 2, AT_POSITION = 4;
const CLOSE = (0.05 * Math.PI) / 180, NEAR = (5 * Math.PI) / 180, MOVED = Math.PI / 180;

export class Rows {
  readonly fields = new Map<string, [start: number, width: number]>();
  readonly width: number;
  data: Float64Array;
  count = 0;
  /** Rows that were dropped because a run was long. */
  gone = 0;

  constructor(widths: [name: string, width: number][]) {
    let at = 0;
    for (const [name, width] of widths) {
      this.fields.set(name, [at, width]);
      at += width;
    }
    this.width = at;
    this.data = new Float64Array(at * 2048);
  }

  /** A new row, filled with NaN. */
  next(): Float64Array {
    if (this.count === KEPT) {
      this.data.copyWithin(0, (KEPT / 2) * this.width, KEPT * this.width);
      this.count -= KEPT / 2;
      this.gone += KEPT / 2;
    }
    if ((this.count + 1) * this.width > this.data.length) {
      const larger = new Float64Array(2 * this.data.length);
      larger.set(this.data);
      this.data = larger;
    }
    return this.data.subarray(this.count * this.width, ++this.count * this.width).fill(NaN);
  }

  clear(): void { this.count = this.gone = 0; }

  /** The values of a field in a row. */
  at(row: number, name: string): Float64Array {
    const found = this.fields.get(name);
    if (!found) throw new Error(`this run has no ${name}`);
    return this.data.subarray(row * this.width + found[0], row * this.width + found[0] + found[1]);
  }
}

type OfRow = (rows: Rows, row: number) => number;
const finite = (value: number): number => (isFinite(value) ? value : 0);
const share = (value: string, bound: string): OfRow => (rows, row) => {
  const limits = rows.at(row, bound);
  return rows.at(row, value).reduce((most, each, a) => Math.max(most, finite(Math.abs(each) / limits[a])), 0);
};
const bit = (wanted: number): OfRow => (rows, row) => rows.at(row, "at_bound").some((bits) => (finite(bits) & wanted) !== 0) ? 1 : 0;

function ahead(rows: Rows, row: number): Float64Array {
  const q = rows.at(row, "q"), low = rows.at(row, "q_lower"), high = rows.at(row, "q_upper");
  return rows.at(row, "v").map((v, a) => Math.max(v > 0 ? high[a] - q[a] : q[a] - low[a], 0));
}
const largest = (values: Iterable<number>): number => {
  let most = NaN;
  for (const each of values) if (!isNaN(each) && !(each <= most)) most = each;
  return most;
};

const DERIVED: Record<string, OfRow> = {
  "torque share": share("tau_demand", "tau_upper"),
  "speed share": share("v", "v_limit"),
  "position share": (rows, row) => {
    const low = rows.at(row, "q_lower"), high = rows.at(row, "q_upper");
    return rows.at(row, "q").reduce((most, q, a) =>
      Math.max(most, finite(Math.abs(q - 0.5 * (low[a] + high[a])) / (0.5 * (high[a] - low[a])))), 0);
  },
  "deceleration to stop": (rows, row) => {
    const left = ahead(rows, row);
    return largest(rows.at(row, "v").map((v, a) => (left[a] > CLOSE ? v ** 2 / (2 * Math.max(left[a], CLOSE)) : NaN)));
  },
  "speed within 5° of an end": (rows, row) => {
    const left = ahead(rows, row);
    return largest(rows.at(row, "v").map((v, a) => (left[a] < NEAR ? Math.abs(v) : NaN)));
  },
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

function signalAt(signal: SignalData, rows: Rows, row: number): number {
  const derived = DERIVED[signal.name];
  if (derived) return signal.factor * derived(rows, row);
  const found = rows.at(row, signal.name);
  if (found.length === 1) return signal.factor * found[0];
  return signal.factor * (signal.column === null ? Math.hypot(...found) : found[signal.column]);
}

const sum = (values: number[]): number => values.reduce((total, each) => total + each, 0);
const STATISTICS: Record<string, (values: number[]) => number> = {
  largest: (values) => values.reduce((most, each) => Math.max(most, Math.abs(each)), 0),
  rms: (values) => Math.sqrt(sum(values.map((each) => each ** 2)) / values.length),
  mean: (values) => sum(values) / values.length,
  range: (values) => values.reduce((a, b) => Math.max(a, b)) - values.reduce((a, b) => Math.min(a, b)),
  last: (values) => sum(values.slice(-50)) / Math.min(50, values.length),
  sum,
};

/** The number so far; NaN as long as there is nothing to measure. */
export function measured(measure: MeasureData, rows: Rows, ghost: Rows | null): number {
  const values: number[] = [];
  for (let row = 0; row < rows.count; row++) {
    const t = rows.at(row, "t")[0];
    if (!(t >= measure.after - 1e-9 && t < (measure.until ?? Infinity) - 1e-9)) continue;
    const value = signalAt(measure.signal, rows, row);
    if (isFinite(value)) values.push(value);
  }
  const own = values.length ? STATISTICS[measure.statistic](values) : NaN;
  if (!measure.over_ghost) return own;
  const other = ghost ? measured({ ...measure, over_ghost: false }, ghost, null) : NaN;
  return other ? own / other : NaN;
}

export const holds = (claim: ClaimData, value: number): boolean =>
  claim.relation === "at most" ? value <= claim.bound : value >= claim.bound;

/** ‖I − M⁻¹M̄‖₂ and the spectral radius of I − M⁻¹M̄; M row by row: robots/inertia.py. */
export function gauge(M: Float64Array, M_bar: number[]): [norm: number, radius: number] {
  const n = M_bar.length, inverse = inverted(M, n), error = new Float64Array(n * n), similar = new Float64Array(n * n);
  for (let i = 0; i < n; i++) for (let j = 0; j < n; j++) {
    error[i * n + j] = (i === j ? 1 : 0) - inverse[i * n + j] * M_bar[j];
    similar[i * n + j] = Math.sqrt(M_bar[i]) * inverse[i * n + j] * Math.sqrt(M_bar[j]);
  }
  const squares = new Float64Array(n * n);
  for (let i = 0; i < n; i++) for (let j = 0; j < n; j++) for (let k = 0; k < n; k++)
    squares[i * n + j] += error[k * n + i] * error[k * n + j];
  return [Math.sqrt(Math.max(...eigenvalues(squares, n), 0)), Math.max(...eigenvalues(similar, n).map((x) => Math.abs(1 - x)))];
}

/** The inverse of a positive definite matrix, by Gauss and Jordan. */
function inverted(M: Float64Array, n: number): Float64Array {
  const left = M.slice(), right = new Float64Array(n * n);
  for (let i = 0; i < n; i++) right[i * n + i] = 1;
  for (let p = 0; p < n; p++) {
    const pivot = left[p * n + p];
    for (const side of [left, right]) for (let j = 0; j < n; j++) side[p * n + j] /= pivot;
    for (let i = 0; i < n; i++) {
      const factor = left[i * n + p];
      if (i !== p) for (const side of [left, right]) for (let j = 0; j < n; j++) side[i * n + j] -= factor * side[p * n + j];
    }
  }
  return right;
}

/** The eigenvalues of a symmetric matrix, by Jacobi's rotations. */
function eigenvalues(A: Float64Array, n: number): number[] {
  A = A.slice();
  for (let sweep = 0; sweep < 30; sweep++) for (let p = 0; p < n; p++) for (let q = p + 1; q < n; q++) {
    const off = A[p * n + q];
    if (Math.abs(off) < 1e-300) continue;
    const theta = (A[q * n + q] - A[p * n + p]) / (2 * off);
    const t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1)), c = 1 / Math.sqrt(t * t + 1), s = t * c;
    for (let k = 0; k < n; k++) {
      const a = A[k * n + p], b = A[k * n + q];
      A[k * n + p] = c * a - s * b;
      A[k * n + q] = s * a + c * b;
    }
    for (let k = 0; k < n; k++) {
      const a = A[p * n + k], b = A[q * n + k];
      A[p * n + k] = c * a - s * b;
      A[q * n + k] = s * a + c * b;
    }
  }
  return Array.from({ length: n }, (_, k) => A[k * n + k]);
}
