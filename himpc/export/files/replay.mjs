// Replays a recorded run of the exported controller and prints the largest difference of a torque: node replay.mjs
import { readFileSync } from "node:fs";
import { TARGET, kernel } from "./himpc.mjs";

const file = (name) => readFileSync(new URL(name, import.meta.url));
const create = await kernel(file("himpc.wasm"));
const manifest = JSON.parse(file("controller.json"));
const pair = [create(file("controller.bin"), manifest), create(file("controller.bin"), manifest)];
const n = manifest.joints.length, bytes = file("vector.bin"), aligned = bytes.buffer.slice(bytes.byteOffset);
const [ticks, count] = new BigInt64Array(aligned, 0, 2), MOVE = 11;
const moves = new Float64Array(aligned, 16, Number(count) * MOVE);
const rows = new Float64Array(aligned, 16 + 8 * moves.length, Number(ticks) * 4 * n);

let worst = 0, fallbacks = 0, next = 0;
const us = [];
for (let k = 0; k < ticks; k++) {
  for (; next < count && moves[next * MOVE] === k; next++) {
    const [, task, size, ...values] = moves.subarray(next * MOVE, (next + 1) * MOVE);
    for (const each of pair) each.set(TARGET, task, values.slice(0, size));
  }
  const at = k * 4 * n, [q, v, applied, wanted] = [0, 1, 2, 3].map((i) => rows.subarray(at + i * n, at + (i + 1) * n));
  for (const [i, each] of pair.entries()) {
    const begun = performance.now();
    const [tau, fallback] = each.tick(q, v, applied);
    if (i === 0) us.push(1e3 * (performance.now() - begun)), (fallbacks += fallback !== 0);
    for (let a = 0; a < n; a++) if (!(Math.abs(tau[a] - wanted[a]) <= worst)) worst = Math.abs(tau[a] - wanted[a]);
  }
}
// The first half of the run is not counted: the browser's compiler is still at work.
const late = us.slice(us.length >> 1).sort((a, b) => a - b);
console.log(`${ticks} ticks: largest difference ${worst.toExponential(1)} N m, ` +
  `median ${late[late.length >> 1].toFixed(1)} us a tick, ${fallbacks} ticks with a fallback`);
process.exit(worst <= 1e-6 ? 0 : 1);
