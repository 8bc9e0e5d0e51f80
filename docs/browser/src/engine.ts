/** The page's connection to the simulation, a thread that contains MuJoCo and the kernel. */
import type { Simulation, Told } from "./worker";

type Answer<K extends keyof Simulation> = Awaited<ReturnType<Simulation[K]>>;

/** Returns the data that a script stored on the page under a name, as text. */
export function packed(name: string): string {
  const text = window.HIMPC_PACKS?.[name];
  if (text === undefined) throw new Error(`the file with ${name} was not loaded`);
  return text;
}

export class Engine {
  private worker = new Worker(URL.createObjectURL(new Blob([WORKER_TEXT], { type: "text/javascript" })));
  private waiting: PromiseWithResolvers<never>[] = [];
  mujoco = "";
  /** Called with messages that the simulation sends unasked, and with errors of `tell`. */
  onTold: (told: Told) => void = () => {};

  constructor() {
    // The simulation answers calls in the order in which the page makes them.
    this.worker.onmessage = ({ data }: MessageEvent<Told | { answer: unknown } | { refusal: string }>) => {
      if ("answer" in data) this.waiting.shift()!.resolve(data.answer as never);
      else if ("refusal" in data) this.waiting.shift()!.reject(new Error(data.refusal));
      else this.onTold(data);
    };
  }

  async load(): Promise<void> {
    this.mujoco = await this.call("load", packed("mujoco"), packed("kernel"));
  }

  /** Calls a function of the simulation and waits for its answer; throws an Error with a sentence if the simulation refuses. */
  call<K extends keyof Simulation>(name: K, ...given: Parameters<Simulation[K]>): Promise<Answer<K>> {
    this.worker.postMessage({ name, given });
    return this.waiting[this.waiting.push(Promise.withResolvers<never>()) - 1].promise;
  }

  /** Calls a function of the simulation that returns nothing; does not wait. */
  tell<K extends keyof Simulation>(name: K, ...given: Parameters<Simulation[K]>): void {
    this.call(name, ...given).catch(({ message }: Error) => this.onTold({ error: message }));
  }

  end(): void { this.worker.terminate(); }
}
