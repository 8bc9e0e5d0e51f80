/** The page's end of the simulation: a thread with MuJoCo and the kernel in it. */
import type { Frame, Told, Verdict } from "./messages";
import type { Simulation } from "./worker";

type Answer<K extends keyof Simulation> = Awaited<ReturnType<Simulation[K]>>;

/** The script that gave something to the page under a name, as text. */
export function packed(name: string): string {
  const text = window.HIMPC_PACKS?.[name];
  if (text === undefined) throw new Error(`the file with ${name} was not loaded`);
  return text;
}

export class Engine {
  private worker = new Worker(URL.createObjectURL(new Blob([WORKER_TEXT], { type: "text/javascript" })));
  private waiting = new Map<number, PromiseWithResolvers<never>>();
  private calls = 0;
  mujoco = "";
  onFrame: (frame: Frame) => void = () => {};
  onVerdict: (verdict: Verdict) => void = () => {};
  /** Called with a sentence about something that did not work and that nobody waits for. */
  onError: (words: string) => void = () => {};

  constructor() {
    this.worker.onmessage = ({ data }: MessageEvent<Told>) => {
      if ("frame" in data) this.onFrame(data.frame);
      else if ("verdict" in data) this.onVerdict(data.verdict);
      else if (!("id" in data)) this.onError(data.error);
      else {
        const { resolve, reject } = this.waiting.get(data.id)!;
        this.waiting.delete(data.id);
        if (data.error === undefined) resolve(data.value as never);
        else reject(new Error(data.error));
      }
    };
  }

  async load(): Promise<void> {
    this.mujoco = await this.call("load", packed("mujoco"), packed("kernel"));
  }

  /** Calls a function of the simulation and waits for its answer; throws an Error with the sentence of a refusal. */
  call<K extends keyof Simulation>(name: K, ...given: Parameters<Simulation[K]>): Promise<Answer<K>> {
    const asked = Promise.withResolvers<never>();
    this.waiting.set(++this.calls, asked);
    this.worker.postMessage({ id: this.calls, name, given });
    return asked.promise;
  }

  /** Calls a function that answers nothing. */
  tell<K extends keyof Simulation>(name: K, ...given: Parameters<Simulation[K]>): void {
    this.call(name, ...given).catch((error: Error) => this.onError(error.message));
  }

  end(): void { this.worker.terminate(); }
}
