/** The program of the worker, put here by build.mjs. */
declare const WORKER_TEXT: string;
declare module "*.css" {
  const text: string;
  export default text;
}
