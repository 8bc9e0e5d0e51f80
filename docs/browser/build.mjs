// Bundles the live figures into one classic script, which contains the worker's program as text: node build.mjs OUT.
import { writeFileSync } from "node:fs";
import { build } from "esbuild";

const shared = { bundle: true, minify: true, format: "iife", target: "es2022", write: false, legalComments: "none",
  logLevel: "error", loader: { ".css": "text" } };
const worker = await build({ ...shared, entryPoints: ["src/worker.ts"], external: ["module", "fs", "path", "url",
  "node:*", "worker_threads"], define: { "import.meta.url": '""' }, outfile: "worker.js" });
const page = await build({ ...shared, entryPoints: ["src/main.ts"], outfile: "live.js",
  define: { WORKER_TEXT: JSON.stringify(worker.outputFiles[0].text) } });
writeFileSync(process.argv[2], page.outputFiles[0].contents);
