/** The program of the worker, put here by build.mjs. */
declare const WORKER_TEXT: string;
declare module "*.css" {
  const text: string;
  export default text;
}
declare module "*/himpc.mjs" {
  export const TARGET: number, M_BAR: number, GAINS: number, Q: number, R: number, LIMITS: number, ENABLED: number;
  export const FALLBACKS: string[];
  export interface Manifest {
    joints: string[];
    tasks: { name: string; index: number; rows: number; target: string }[];
    levels: { name: string; index: number; rows: number; tasks: string[] }[];
    arrays: { name: string; type: string; shape: number[]; offset: number }[];
    /** Fields of telemetry: where their numbers are in an array. Written by docs/figures/scene.py. */
    fields: [name: string, array: string, start: number, width: number][];
  }
  export interface Controller {
    n: number;
    tick(q: Float64Array, v: Float64Array, applied: Float64Array | null): [Float64Array, number];
    reset(tau: Float64Array | null): void;
    set(what: number, index: number, values: ArrayLike<number>): void;
    view(name: string): Float64Array;
  }
  export function kernel(wasm: ArrayBuffer): Promise<(image: Uint8Array, manifest: Manifest) => Controller>;
}
