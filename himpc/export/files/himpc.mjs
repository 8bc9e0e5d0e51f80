// The exported controller in a browser or in Node. One module may hold many controllers.
const { sin, cos, tan, atan2, hypot, exp, expm1, log, sqrt, pow } = Math;
const env = { sin, cos, tan, atan2, hypot, exp, expm1, log, sqrt, pow };
export const TARGET = 0, M_BAR = 1, GAINS = 2, Q = 3, R = 4, LIMITS = 5, ENABLED = 6, ORDER = 7, WEIGHTS = 8, BUDGET = 9, OBJECT = 10;
const WRONG = ["was made for another kernel", "belongs to another controller.json", "is damaged"];
export const FALLBACKS = ["solve", "soften", "feasible", "previous", "inherit", "brake", "hold"];

/**
 * What controller.json says; lengths and indices are numbers of elements, `offset` is in bytes.
 * @typedef {{ name: string, index: number, rows: number, target: string }} Task
 * @typedef {{ name: string, index: number, rows: number, tasks: string[] }} Level
 * @typedef {{ name: string, type: string, shape: number[], offset: number }} Listed
 * @typedef {{ joints: string[], digest: string, tasks: Task[], levels: Level[], objects: string[], arrays: Listed[] }} Manifest
 */

/** Makes what creates controllers. @param {ArrayBuffer} wasm bytes of himpc.wasm */
export async function kernel(wasm) {
  const { instance } = await WebAssembly.instantiate(wasm, { env });
  const { memory, himpc_tick, himpc_reset, himpc_set, himpc_check, __heap_base } = instance.exports;
  let end = __heap_base.value;
  const take = (bytes) => {
    const at = (end + 63) & ~63;
    end = at + bytes;
    if (end > memory.buffer.byteLength) memory.grow(Math.ceil((end - memory.buffer.byteLength) / 65536));
    return at;
  };
  /**
   * A controller.
   * @param {Uint8Array} image bytes of controller.bin
   * @param {Manifest} manifest controller.json, parsed
   */
  return function create(image, manifest) {
    const n = manifest.joints.length;
    const at = take(image.byteLength), given = take(8 * Math.max(4 * n, 64));
    new Uint8Array(memory.buffer, at, image.byteLength).set(image);
    const wrong = himpc_check(at, image.byteLength, BigInt.asIntN(64, BigInt(`0x${manifest.digest}`)));
    if (wrong) throw new Error(`controller.bin ${WRONG[-wrong - 1]}: export again`);
    const numbers = (offset, count) => new Float64Array(memory.buffer, offset, count);
    /** @type {(what: number, index: number, values: ArrayLike<number>) => void} */
    const set = (what, index, values) => {
      numbers(given, values.length).set(values);
      const wrong = himpc_set(at, what, index, given, values.length);
      if (wrong) throw new Error(`the setting was refused (${wrong}): see himpc.h`);
    };
    const index = (of, name) => {
      const found = manifest[of].find((each) => each.name === name);
      if (!found) throw new Error(`there is no ${name} among the ${of}`);
      return found.index;
    };
    const arrays = Object.fromEntries(manifest.arrays.map((each) => [each.name, each]));
    himpc_reset(at, 0);
    return {
      n,
      /**
       * One control period; returns the torque (N·m) and which fallback acted.
       * @type {(q: Float64Array, v: Float64Array, applied: Float64Array | null) => [Float64Array, number]}
       */
      tick: (q, v, applied) => {
        const values = numbers(given, 4 * n);
        values.set(q);
        values.set(v, n);
        if (applied) values.set(applied, 2 * n);
        const fallback = himpc_tick(at, given, given + 8 * n, applied ? given + 16 * n : 0, given + 24 * n);
        return [numbers(given + 24 * n, n), fallback];
      },
      /** @param {Float64Array | null} tau the torque that acts now (N·m) */
      reset(tau) {
        if (tau) numbers(given, n).set(tau);
        himpc_reset(at, tau ? given : 0);
      },
      set,
      setTarget: (task, values) => set(TARGET, index("tasks", task), values),
      setGains: (task, K_p, K_v) => set(GAINS, index("tasks", task), [...K_p, ...K_v]),
      enable: (level, on) => set(ENABLED, index("levels", level), [on ? 1 : 0]),
      /** A live view of an array of the manifest. @param {string} name @returns {Float64Array} */
      view(name) {
        const { type, shape, offset } = arrays[name], count = shape.reduce((a, b) => a * b, 1);
        return type === "int64" ? new BigInt64Array(memory.buffer, at + offset, count) : numbers(at + offset, count);
      },
    };
  };
}
