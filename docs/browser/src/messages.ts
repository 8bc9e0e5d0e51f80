/** What the page and the simulation say to each other: the page calls a function of the simulation by its name. */
import type { RobotData, SceneData, StepData } from "./data";
import type { Simulation } from "./worker";

export interface Open { scenes: string; robot: RobotData; step: string | null; assignments: string[] }
/** What was opened: the scene with its own settings, and the tasks that have errors. */
export interface Opened { scene: SceneData; step: StepData | null; tasks: { name: string; unit: string; target: string }[] }
export interface Verdict { claims: number[]; prediction: number }
/** What a figure draws of a moment; curves: t, then errors of the tasks, torques and speeds over their bounds. */
export interface Frame {
  t: number; running: boolean; poses: Float32Array; ghost: Float32Array | null; curves: Float32Array; width: number;
  targets: { task: string; kind: string; value: number[] }[]; binding: string[]; fallback: string; speed: number;
  us: number; order: string[]; horizon: number; lost: boolean; restarted: boolean;
}
export type Call = { id: number } & { [K in keyof Simulation]: { name: K; given: Parameters<Simulation[K]> } }[keyof Simulation];
/** The answer to a call, or what the simulation says by itself. */
export type Told = { id: number; value?: unknown; error?: string } | { frame: Frame } | { verdict: Verdict } | { error: string };
