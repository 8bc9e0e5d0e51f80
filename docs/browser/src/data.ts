/** The data that docs/figures/ writes for the page. Units are SI, quaternions are x y z w, and null means no limit. */
import type { Manifest } from "../../../himpc/export/files/himpc.mjs";
import type { State } from "./code";

export type Piece = [offset: number, bytes: number];
export type Numbers = number | number[];

export interface Body { mass: number; ipos: number[]; inertia: number[]; prismatic: boolean; armature: number }
export interface Shape { joint: number; colour: string; grid: number; vertices: Piece; faces: Piece }
export interface RobotData {
  name: string; joints: string[]; bodies: Body[]; reach: number; planar: boolean; tip: { joint: number; pos: number[] };
  gravity: number[]; shapes: Shape[];
  tau_limit: (number | null)[]; v_limit: (number | null)[]; q_lower: (number | null)[]; q_upper: (number | null)[];
}

export interface PlantSettings {
  payload_kg: number; friction: Numbers; damping: Numbers; armature: Numbers; mass_scale: Numbers; inertia_scale: Numbers;
  encoder_resolution_deg: number; saturate: boolean; gravity: boolean; contacts: boolean; joint_stops: boolean;
}
export interface TaskData {
  name: string; level: number; axes: string; unit: string; target: string; K_p: Numbers; K_v: Numbers;
  frame: { joint: number; pos: number[] } | null;
}
export interface LevelData { name: string; Q: Numbers; R: Numbers; enabled: boolean }
/** An object that is drawn: its body in MuJoCo, its geometry in MuJoCo, and its pose at the start. */
export interface Thing { body: string; kind: string; size: number[]; pose: number[] }
/** A field of a row; `array` is "" for fields that the session itself writes. */
export type Field = [name: string, array: string, start: number, width: number];
export type SceneEvent = { t: number; event: string; [key: string]: unknown };
export interface SceneData {
  name: string; robot: string; controller: string; period: number; horizon: number; order: string[]; duration: number;
  start: { q: number[]; v: number[]; tau: number[] | null };
  M_bar: number[]; M_bar_scale: number; R_on: string; deadline_ms: number; solve_ms_per_knot: number;
  levels: LevelData[]; tasks: TaskData[];
  limits: { torque: boolean; velocity: boolean; position: string; torque_scale: number; velocity_scale: number };
  plant: PlantSettings; events: SceneEvent[]; model: string; poses: number[]; objects: Thing[];
  /** Objects that can move: index of the controller, and height of the point that it knows above the middle. */
  free: { index: number; above: number }[];
  /** The controllers by their N; the fields of a row with the controller's arrays; the HTML of the controls. */
  images: Record<string, { memory: Piece; manifest: Manifest }>; fields: Field[]; controls: string;
}

export interface SignalData { name: string; column: number | null; factor: number }
export interface MeasureData {
  signal: SignalData; statistic: string; after: number; until: number | null; over_ghost: boolean; unit: string;
}
export interface ClaimData {
  text: string; measure: MeasureData; relation: string; bound: number; condition: string; live: boolean;
}
export interface PredictionData {
  measure: MeasureData; options?: { text: string; low: number | null; high: number | null }[];
}
export interface StepData {
  state: State; set: string[]; scene: SceneData; ghost: SceneData | null; ghost_told: string; ghost_set: string[];
  /** The question and the list of claims as HTML. */
  asking: string; claims: ClaimData[]; prediction: PredictionData | null;
}

/** A description, and the bytes of the pieces to which it refers. */
export interface Pack<T> { told: T; pieces: Uint8Array<ArrayBuffer> }
export interface Scenes { scene?: SceneData; steps?: Record<string, StepData> }

export const through = (bytes: ReadableStream, way: CompressionStream | DecompressionStream, type = ""): Response =>
  new Response(bytes.pipeThrough(way), { headers: { "Content-Type": type } });

/** Returns the content of a script of the site; the browser decodes and decompresses it while the caller reads it. */
export async function unwrapped(text: string): Promise<Response> {
  const { body } = await fetch(`data:;base64,${text}`);
  return through(body!, new DecompressionStream("gzip"), "application/wasm");
}

export async function unpacked<T>(text: string): Promise<Pack<T>> {
  const bytes = await (await unwrapped(text)).arrayBuffer(), length = Number(new BigUint64Array(bytes, 0, 1)[0]);
  const told = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 8, length))) as T;
  return { told, pieces: new Uint8Array(bytes, 8 + length) };
}

export const pieceOf = ({ pieces }: Pack<unknown>, [offset, size]: Piece): Uint8Array<ArrayBuffer> =>
  pieces.subarray(offset, offset + size);
export const each = (values: Numbers, n: number): number[] =>
  typeof values === "number" ? Array<number>(n).fill(values) : values;
export const limit = (value: number | null, sign = 1): number => value ?? sign * Infinity;
