/** What the page and the simulation say to each other. */
import type { RobotData } from "./data";

export interface Open { scenes: ArrayBuffer; robot: RobotData; step: string | null; assignments: string[] }
export type ToWorker =
  | { kind: "load"; mujoco: ArrayBuffer; kernel: ArrayBuffer }
  | ({ kind: "open" } & Open)
  | { kind: "run" | "pause" | "reset" }
  | { kind: "set"; path: string; value: unknown }
  | { kind: "target"; task: string; value: number[] }
  | { kind: "push"; joint: number; force: number[]; seconds: number }
  | { kind: "replay"; ticks: number };

export interface Target { task: string; kind: string; value: number[] }
/** What a figure draws of a moment; curves: t, then errors of the tasks, torques and speeds over their bounds. */
export interface Frame {
  kind: "frame"; t: number; running: boolean; poses: Float32Array; ghost: Float32Array | null;
  targets: Target[]; curves: Float32Array; width: number; binding: string[]; fallback: string; speed: number; us: number;
  order: string[]; horizon: number; lost: boolean; over: boolean; restarted: boolean;
}
export type ToPage =
  | { kind: "ready"; mujoco: string }
  | { kind: "opened"; tasks: { name: string; unit: string; target: string }[] }
  | Frame
  | { kind: "judged"; claims: number[]; prediction: number }
  | { kind: "refused"; words: string }
  | { kind: "failed"; words: string }
  | { kind: "replayed"; tau: Float64Array; ms: number; claims: number[]; prediction: number };
