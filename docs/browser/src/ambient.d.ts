/** The program of the worker; build.mjs inserts its text. */
declare const WORKER_TEXT: string;
declare module "*.css" {
  const text: string;
  export default text;
}
