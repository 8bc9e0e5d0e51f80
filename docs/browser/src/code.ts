/** State codes, which contain all settings of a run; the format is that of lessons/replay/state.py. */
import { through } from "./data";

const PREFIX = "hl1-", MOST = 12_000;

export interface State { s: string; r?: string; a?: string[]; l?: string; p?: number }

export async function encode(state: State): Promise<string> {
  const plain = new Blob([JSON.stringify(state)]).stream();
  const packed = new Uint8Array(await through(plain, new CompressionStream("deflate")).arrayBuffer());
  return PREFIX + btoa(String.fromCharCode(...packed)).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

/** Returns the state of a code, or null if the text is not a code. Its names and numbers are checked where they are used. */
export async function decode(code: string): Promise<State | null> {
  if (!code.startsWith(PREFIX) || code.length > MOST || !/^[\w-]+$/.test(code)) return null;
  try {
    const { body } = await fetch(`data:;base64,${code.slice(PREFIX.length).replace(/-/g, "+").replace(/_/g, "/")}`);
    const given = await through(body!, new DecompressionStream("deflate")).json() as State, list = given.a ?? [];
    const short = typeof given.s === "string" && Array.isArray(list) && list.length <= 500;
    return short && list.every((each) => typeof each === "string" && each.includes("=")) ? given : null;
  } catch {
    return null;
  }
}

/** Splits "PATH=VALUE" into path and value. */
export function split(assignment: string): [path: string, value: unknown] {
  const at = assignment.indexOf("="), text = assignment.slice(at + 1);
  try {
    return [assignment.slice(0, at), JSON.parse(text)];
  } catch {
    return [assignment.slice(0, at), text];
  }
}

/** Returns a changed setting as "PATH=VALUE". */
export const assignment = (path: string, value: unknown): string =>
  `${path}=${typeof value === "string" ? value : JSON.stringify(value)}`;
