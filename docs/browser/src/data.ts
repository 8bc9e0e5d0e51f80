/** What docs/figures/ writes for the page. SI units; quaternions w x y z; null: no limit. */
import type { Manifest } from "../../../himpc/export/files/himpc.mjs";

export type Piece = [offset: number, bytes: number];
export type Numbers = number | number[];

export interface Body {
  parent: number; pos: number[]; quat: number[]; mass: number; ipos: number[]; inertia: number[];
  prismatic: boolean; axis: number[];
}
export interface Solid { joint: number; kind: string; size: number[]; points: number[][]; pos: number[]; quat: number[] }
export interface Shape { joint: number; colour: number[]; grid: number; wide: boolean; vertices: Piece; faces: Piece }
export interface RobotData {
  name: string; joints: string[]; bodies: Body[]; tip: { joint: number; pos: number[] }; gravity: number[];
  solids: Solid[]; excluded: [number, number][]; home: number[]; shapes: Shape[];
  tau_limit: (number | null)[]; v_limit: (number | null)[]; q_lower: (number | null)[]; q_upper: (number | null)[];
}

export interface PlantSettings {
  payload_kg: number; friction: Numbers; damping: Numbers; armature: Numbers; mass_scale: Numbers; inertia_scale: Numbers;
  diagonal_scale: Numbers; encoder_resolution_deg: number; torque_lag_ms: number; delay_ms: number;
  saturate: boolean; gravity: boolean; contacts: boolean; joint_stops: boolean;
}
export interface Floor { height: number; friction: number }
export interface TaskData {
  name: string; axes: string; unit: string; K_p: Numbers; K_v: Numbers; frame: { joint: number; pos: number[] } | null;
}
export interface LevelData { name: string; Q: Numbers; R: Numbers; enabled: boolean; tasks: TaskData[] }
export type SceneEvent = { t: number; event: string; [key: string]: unknown };
export interface ImageData { memory: Piece; manifest: Omit<Manifest, "arrays"> & { arrays: [string, string, number[], number][] } }
export interface SceneData {
  name: string; robot: string; controller: string; period: number; horizon: number; order: string[]; duration: number;
  start: { q: number[]; v: number[]; tau: number[] | null };
  M_bar: number[]; M_bar_scale: number; R_on: string; deadline_ms: number; solve_ms_per_knot: number;
  levels: LevelData[];
  limits: { torque: boolean; velocity: boolean; position: string; torque_scale: number; velocity_scale: number };
  plant: PlantSettings; world: Floor[]; events: SceneEvent[]; images: Record<string, ImageData>;
}

export interface SignalData { name: string; column: number | null; factor: number }
export interface MeasureData {
  signal: SignalData; statistic: string; after: number; until: number | null; over_ghost: boolean; unit: string;
}
export interface ClaimData {
  text: string; measure: MeasureData; relation: string; bound: number; condition: string; live: boolean;
}
export interface PredictionData {
  kind: "choice" | "value"; question: string; measure: MeasureData;
  options?: { text: string; low: number | null; high: number | null }[];
  low?: number; high?: number; factor?: number;
}
export interface StepData {
  lesson: string; scene_name: string; robot_name: string | null; set: string[]; scene: SceneData;
  ghost: SceneData | null; ghost_words: string | null; ghost_set: string[]; ghost_missing: string | null;
  claims: ClaimData[]; prediction: PredictionData | null;
}

/** A description with the pieces that it refers to. */
export interface Pack<T> { told: T; piece(at: Piece): Uint8Array }
export interface Scenes { scene?: SceneData; steps?: Record<string, StepData> }

/** What a script of the site holds, decompressed by the browser itself. */
export function unwrapped(text: string): Response {
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream, { headers: { "Content-Type": "application/wasm" } });
}

export async function unpacked<T>(text: string): Promise<Pack<T>> {
  const bytes = await unwrapped(text).arrayBuffer(), length = Number(new BigUint64Array(bytes, 0, 1)[0]);
  const told = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 8, length))) as T;
  return { told, piece: ([offset, size]) => new Uint8Array(bytes, 8 + length + offset, size) };
}

export const each = (values: Numbers, n: number): number[] =>
  typeof values === "number" ? Array<number>(n).fill(values) : values;
export const limit = (value: number | null, sign = 1): number => value ?? sign * Infinity;
