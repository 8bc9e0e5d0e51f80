/** The robot in MuJoCo under torque control: robots/plant.py and robots/signals.py, without an altered diagonal. */
import type { MainModule, MjData, MjModel } from "@mujoco/mujoco";
import { limit, type Floor, type PlantSettings, type RobotData } from "./data";
import { mjcf } from "./model";

const TIMESTEP = 1e-3, MEMORY_S = 1.5, SAMPLES_S = 0.3, BROKEN = 1e6;
type Vector = Float64Array;
type Stamped = [t: number, value: Vector];

export class Plant {
  readonly n: number;
  tau: Vector;
  broken = false;
  private model!: MjModel;
  data!: MjData;
  private commands: Stamped[] = [];
  private samples: Stamped[] = [];
  private start!: { q: Vector; v: Vector };
  private wrench: { joint: number; values: number[] } | null = null;

  constructor(private mj: MainModule, readonly robot: RobotData, public settings: PlantSettings, private world: Floor[]) {
    this.n = robot.bodies.length;
    this.tau = new Float64Array(this.n);
    this.build();
  }

  private build(): void {
    this.data?.delete();
    this.model?.delete();
    this.model = this.mj.MjModel.from_xml_string(mjcf(this.robot, this.settings, this.world));
    this.data = new this.mj.MjData(this.model);
  }

  get t(): number { return this.data.time; }
  get q(): Vector { return Float64Array.from(this.data.qpos.subarray(0, this.n) as Vector); }
  get v(): Vector { return Float64Array.from(this.data.qvel.subarray(0, this.n) as Vector); }

  private clipped(tau: Vector): Vector {
    if (!this.settings.saturate) return tau;
    return tau.map((value, a) => Math.min(Math.max(value, -limit(this.robot.tau_limit[a])), limit(this.robot.tau_limit[a])));
  }

  reset(q: number[], v: number[], tau: number[] | null): void {
    this.mj.mj_resetData(this.model, this.data);
    this.data.qpos.set(q);
    this.wrench = null;
    this.broken = false;
    this.tau = this.clipped(tau === null ? this.holding() : Float64Array.from(tau));
    this.data.qvel.set(v);
    this.commands = [[-MEMORY_S, this.tau]];
    this.start = { q: Float64Array.from(q), v: Float64Array.from(v) };
    this.samples = [[0, this.start.q]];
  }

  /** What a copy of the state gives, of which positions have been computed. */
  private probed<T>(act: (probe: MjData) => T): T {
    const probe = new this.mj.MjData(this.model);
    probe.qpos.set(this.data.qpos as Vector);
    this.mj.mj_fwdPosition(this.model, probe);
    const found = act(probe);
    probe.delete();
    return found;
  }

  /** The torque that keeps the robot where it is. */
  private holding(): Vector {
    return this.probed((probe) => {
      this.mj.mj_fwdVelocity(this.model, probe);
      return Float64Array.from(probe.qfrc_bias.subarray(0, this.n) as Vector);
    });
  }

  configure(settings: PlantSettings): void {
    this.settings = settings;
    const { t, q, v } = this, warm = Float64Array.from(this.data.qacc_warmstart as Vector);
    this.build();
    this.data.time = t;
    this.data.qpos.set(q);
    this.data.qvel.set(v);
    this.data.qacc_warmstart.set(warm);
    this.commands = this.commands.map(([t, tau]) => [t, this.clipped(tau)]);
    this.tau = this.clipped(this.tau);
    if (this.wrench) this.push(this.wrench.joint, this.wrench.values);
  }

  /** A force (N) and torque (N·m) on the body of a joint from now on; joint 0 ends it. */
  push(joint: number, values: number[]): void {
    this.data.xfrc_applied.fill(0);
    this.wrench = joint ? { joint, values } : null;
    // Bodies are numbered in depth-first order, which for a serial arm is that of the joints.
    if (joint) this.data.xfrc_applied.set(values, 6 * this.mj.mj_name2id(this.model, 1, `body${joint}`));
  }

  measure(period: number): [q: Vector, v: Vector] {
    const step = (this.settings.encoder_resolution_deg * Math.PI) / 180;
    if (!(step > 0)) return [this.q, this.v];
    const [now, q] = this.samples.at(-1)!, [then, before] = this.sampled(now - period), v = this.v;
    const rounded = q.map((value, a) => (this.robot.bodies[a].prismatic ? value : even(value / step) * step));
    return [rounded, v.map((value, a) => this.robot.bodies[a].prismatic ? value :
      (rounded[a] - even(before[a] / step) * step) / Math.max(now - then, 1e-9))];
  }

  private sampled(stamp: number): Stamped {
    if (stamp < -1e-9) return [stamp, this.start.q.map((value, a) => value + this.start.v[a] * stamp)];
    const k = this.samples.findLastIndex(([t]) => t <= stamp), last = this.samples.length - 1;
    const before = this.samples[Math.max(k, 0)], later = this.samples[Math.min(k + 1, last)];
    return stamp - before[0] <= later[0] - stamp ? before : later;
  }

  step(tau: Vector, period: number): void {
    const { torque_lag_ms, delay_ms } = this.settings, now = this.t;
    this.commands.push([now, this.clipped(Float64Array.from(tau))]);
    while (this.commands.length > 1 && this.commands[1][0] < now - MEMORY_S) this.commands.shift();
    const count = Math.max(1, Math.ceil(period / TIMESTEP - 1e-9)), h = period / count;
    this.model.opt.timestep = h;
    for (let k = 0; k < count; k++) {
      const t = this.t, wanted = delay_ms > 0 ? this.delayed(t - 1e-3 * delay_ms + 0.5 * h) : this.commands.at(-1)![1];
      const share = torque_lag_ms > 0 ? 1 - Math.exp(-h / (1e-3 * torque_lag_ms)) : 1;
      this.tau = share === 1 ? wanted : this.tau.map((value, a) => value + share * (wanted[a] - value));
      this.data.ctrl.set(this.tau);
      const before = this.q;
      this.mj.mj_step(this.model, this.data);
      if (!this.v.every((value) => Math.abs(value) < BROKEN)) {
        this.data.qpos.set(before);
        this.data.qvel.fill(0);
        this.data.qacc_warmstart.fill(0);
        this.broken = true;
      }
      if (this.settings.encoder_resolution_deg > 0) {
        this.samples.push([this.t, this.q]);
        while (this.samples[0][0] < this.t - SAMPLES_S) this.samples.shift();
      }
    }
  }

  private delayed(stamp: number): Vector {
    return (this.commands.findLast(([t]) => t <= stamp) ?? this.commands[0])[1];
  }

  /** ‖I − M⁻¹M̄‖₂ and the spectral radius of I − M⁻¹M̄: robots/inertia.py. */
  gauge(M_bar: number[]): [norm: number, radius: number] {
    const { n, mj } = this, solved = new mj.DoubleBuffer(n * n), unit = (at: number): number => Number(at % (n + 1) === 0);
    const diagonal = Array.from({ length: n * n }, (_, at) => unit(at) * M_bar[at % n]);
    const ratio = this.probed((probe) => {
      mj.mj_solveM(this.model, probe, solved, diagonal);
      return Float64Array.from(solved.GetView() as Vector);
    });
    solved.delete();
    // Row j of the ratio is column j of M⁻¹M̄; the symmetric M̄^½M⁻¹M̄^½ has its eigenvalues.
    const root = (at: number): number => Math.sqrt(M_bar[at % n] / M_bar[Math.floor(at / n)]);
    return [norm(ratio.map((value, at) => unit(at) - value), n), norm(ratio.map((value, at) => unit(at) - root(at) * value), n)];
  }

  /** Position and quaternion w x y z of the body of each joint at the last stage of the last step, (n, 7). */
  poses(): Float32Array {
    const found = new Float32Array(7 * this.n);
    this.mj.mj_kinematics(this.model, this.data);
    for (let k = 0; k < this.n; k++) {
      const id = this.mj.mj_name2id(this.model, 1, `body${k + 1}`);
      found.set(this.data.xpos.subarray(3 * id, 3 * id + 3) as Vector, 7 * k);
      found.set(this.data.xquat.subarray(4 * id, 4 * id + 4) as Vector, 7 * k + 3);
    }
    return found;
  }

  delete(): void {
    this.data.delete();
    this.model.delete();
  }
}

/** Rounds to the nearest whole number, halves to even ones, as NumPy does. */
function even(value: number): number {
  const down = Math.floor(value);
  return value - down === 0.5 ? 2 * Math.round(down / 2) : Math.round(value);
}

/** The largest singular value of an n × n matrix A: high powers of AᵀA keep its direction only. */
function norm(A: Vector, n: number): number {
  const gram = (B: Vector): Vector => B.map((_, at) => {
    let total = 0;
    for (let k = 0; k < n; k++) total += B[k * n + Math.floor(at / n)] * B[k * n + (at % n)];
    return total;
  });
  const trace = (B: Vector): number => B.reduce((total, value, at) => total + (at % (n + 1) ? 0 : value), 0);
  const squared = gram(A);
  let power = squared;
  for (let k = 0; k < 30 && trace(power) > 0; k++) power = gram(power.map((value) => value / trace(power)));
  const along = power.reduce((total, value, at) => total + value * squared[at], 0);
  return trace(power) > 0 ? Math.sqrt(along / trace(power)) : 0;
}
