/** The robot in MuJoCo under torque control, as in robots/plant.py and robots/signals.py, without diagonal_scale, lag and delay. */
import type { MainModule, MjData, MjModel } from "@mujoco/mujoco";
import { limit, type RobotData, type SceneData } from "./data";
import { mjcf } from "./model";

const TIMESTEP = 1e-3, BROKEN = 1e6;
type Vector = Float64Array;

export class Plant {
  readonly n: number;
  tau!: Vector;
  broken = false;
  private model!: MjModel;
  data!: MjData;
  /** The time at which the last period began, and q at that time. */
  private before!: [t: number, q: Vector];
  private wrench: { joint: number; values: number[] } | null = null;
  /** The largest force between the robot and something that it touched during the last step, N. */
  force = 0;

  constructor(private mj: MainModule, private robot: RobotData, private scene: SceneData) {
    this.n = robot.bodies.length;
    this.build();
  }

  private build(): void {
    this.data?.delete();
    this.model?.delete();
    this.model = this.mj.MjModel.from_xml_string(mjcf(this.scene, this.robot));
    this.data = new this.mj.MjData(this.model);
  }

  get t(): number { return this.data.time; }
  get q(): Vector { return Float64Array.from(this.data.qpos.subarray(0, this.n) as Vector); }
  get v(): Vector { return Float64Array.from(this.data.qvel.subarray(0, this.n) as Vector); }

  private clipped(tau: Vector): Vector {
    if (!this.scene.plant.saturate) return tau;
    return tau.map((value, a) => Math.min(Math.max(value, -limit(this.robot.tau_limit[a])), limit(this.robot.tau_limit[a])));
  }

  reset(q: number[], v: number[], tau: number[] | null): void {
    this.mj.mj_resetData(this.model, this.data);
    this.data.qpos.set(q);
    this.force = 0;
    this.wrench = null;
    this.broken = false;
    this.tau = this.clipped(tau === null ? this.holding() : Float64Array.from(tau));
    this.data.qvel.set(v);
    const { period } = this.scene;
    this.before = [-period, this.q.map((value, a) => value - period * v[a])];
  }

  /** Returns a copy of the state with all quantities computed that depend on positions. */
  private probe(): MjData {
    const probe = new this.mj.MjData(this.model);
    probe.qpos.set(this.data.qpos as Vector);
    this.mj.mj_fwdPosition(this.model, probe);
    return probe;
  }

  /** Returns the torque that keeps the robot in its present pose. */
  private holding(): Vector {
    using probe = this.probe();
    this.mj.mj_fwdVelocity(this.model, probe);
    return Float64Array.from(probe.qfrc_bias.subarray(0, this.n) as Vector);
  }

  /** Applies changed settings and keeps the state. In qpos and qvel the robot comes first; objects exist only with contacts. */
  configure(): void {
    const { t } = this, kept = (["qpos", "qvel", "qacc_warmstart"] as const).map((name) => [name, [...this.data[name]]] as const);
    this.build();
    this.data.time = t;
    for (const [name, values] of kept)
      this.data[name].set(values.length === this.data[name].length ? values : values.slice(0, this.n));
    this.tau = this.clipped(this.tau);
    if (this.wrench) this.push(this.wrench.joint, this.wrench.values);
  }

  /** Applies a force (N) and a torque (N·m) to the body of a joint from now on; joint 0 ends the push. */
  push(joint: number, values: number[]): void {
    this.data.xfrc_applied.fill(0);
    this.wrench = joint ? { joint, values } : null;
    if (joint) this.data.xfrc_applied.set(values, 6 * this.mj.mj_name2id(this.model, 1, `body${joint}`));
  }

  measure(): [q: Vector, v: Vector] {
    const step = (this.scene.plant.encoder_resolution_deg * Math.PI) / 180;
    if (!(step > 0)) return [this.q, this.v];
    const { t, v, before: [then, before] } = this;
    const rounded = this.q.map((value, a) => (this.robot.bodies[a].prismatic ? value : even(value / step) * step));
    return [rounded, v.map((value, a) => this.robot.bodies[a].prismatic ? value :
      (rounded[a] - even(before[a] / step) * step) / Math.max(t - then, 1e-9))];
  }

  /** One control period. */
  step(tau: Vector): void {
    this.tau = this.clipped(Float64Array.from(tau));
    this.data.ctrl.set(this.tau);
    const { period } = this.scene, count = Math.max(1, Math.ceil(period / TIMESTEP - 1e-9));
    this.model.opt.timestep = period / count;
    this.force = 0;
    this.before = [this.t, this.q];
    for (let k = 0; k < count; k++) {
      const before = this.q;
      this.mj.mj_step(this.model, this.data);
      if (!this.v.every((value) => Math.abs(value) < BROKEN)) {
        this.data.qpos.set(before);
        this.data.qvel.fill(0);
        this.data.qacc_warmstart.fill(0);
        this.broken = true;
      }
      if (this.data.ncon) this.force = Math.max(this.force, this.touch());
    }
  }

  /** Returns the largest force between a body of the robot and another body, N, summed over their contact points. */
  private touch(): number {
    const { mj, data, model } = this, forces = new Map<string, number[]>(), object = mj.mj_name2id(model, 5, "shape0");
    using found = new mj.DoubleBuffer(6);
    for (let k = 0; k < data.ncon; k++) {
      using contact = data.contact.get(k)!;
      const { geom1, geom2, frame } = contact;
      if ((object >= 0 && Math.min(geom1, geom2) >= object) || contact.efc_address < 0) continue;
      mj.mj_contactForce(model, data, k, found);
      const force = found.GetView() as Vector, key = `${model.geom_bodyid[geom1]} ${model.geom_bodyid[geom2]}`;
      const before = forces.get(key) ?? [0, 0, 0];
      forces.set(key, before.map((sum, a) => sum + force[0] * frame[a] + force[1] * frame[3 + a] + force[2] * frame[6 + a]));
    }
    return Math.max(0, ...[...forces.values()].map((force) => Math.hypot(...force)));
  }

  /** Returns ‖I − M⁻¹M̄‖₂ and the spectral radius of I − M⁻¹M̄, as robots/inertia.py does. */
  gauge(M_bar: number[]): [norm: number, radius: number] {
    const { n, mj } = this, { nv } = this.model, unit = (at: number): number => Number(at % (n + 1) === 0);
    using probe = this.probe();
    using solved = new mj.DoubleBuffer(n * nv);
    mj.mj_solveM(this.model, probe, solved, Array.from({ length: n * nv }, (_, at) => (at % (nv + 1) ? 0 : M_bar[at % nv])));
    const ratio = Float64Array.from(solved.GetView() as Vector).filter((_, at) => at % nv < n);
    // Row j of the ratio is column j of M⁻¹M̄; the symmetric M̄^½M⁻¹M̄^½ has the same eigenvalues.
    const root = (at: number): number => Math.sqrt(M_bar[at % n] / M_bar[Math.floor(at / n)]);
    return [norm(ratio.map((value, at) => unit(at) - value), n), norm(ratio.map((value, at) => unit(at) - root(at) * value), n)];
  }

  /** Returns position and quaternion x y z w of the body of each joint at the last stage of the last step, (n, 7). */
  poses(): Float32Array {
    this.mj.mj_kinematics(this.model, this.data);
    return this.placed(this.robot.joints.map((_, k) => `body${k + 1}`));
  }

  /** Returns position and quaternion x y z w of each object that is drawn. */
  objects(): Float32Array {
    const { objects } = this.scene;
    return this.scene.plant.contacts ? this.placed(objects.map(({ body }) => body)) : Float32Array.from(objects.flatMap(({ pose }) => pose));
  }

  /** Returns position, quaternion w x y z and velocity of each free object; they exist only with contacts. */
  free(): number[][] {
    const n = this.n, q = this.data.qpos as Vector, v = this.data.qvel as Vector, count = (v.length - n) / 6;
    return Array.from({ length: count }, (_, k) => [...q.subarray(n + 7 * k, n + 7 * k + 7), ...v.subarray(n + 6 * k, n + 6 * k + 3)]);
  }

  private placed(bodies: string[]): Float32Array {
    return Float32Array.from(bodies.flatMap((name) => {
      using body = this.data.body(name);
      const [w, ...xyz] = body.xquat as Vector;
      return [...body.xpos as Vector, ...xyz, w];
    }));
  }

  delete(): void { this.data.delete(); this.model.delete(); }
}

/** Rounds to the nearest whole number, and halves to the nearest even number, as NumPy does. */
function even(value: number): number {
  const down = Math.floor(value);
  return value - down === 0.5 ? 2 * Math.round(down / 2) : Math.round(value);
}

/** Returns the largest singular value of an n × n matrix A by repeated squaring: B = A/‖A‖ is replaced by BᵀB. */
function norm(A: Vector, n: number): number {
  let power = A, log = 0;
  for (let k = 0; k < 50; k++) {
    const size = Math.hypot(...power), B = power.map((value) => value / size);
    if (size === 0) return 0;
    log += Math.log(size) / 2 ** k;
    power = B.map((_, at) => {
      let total = 0;
      for (let row = 0; row < n * n; row += n) total += B[row + Math.floor(at / n)] * B[row + (at % n)];
      return total;
    });
  }
  return Math.exp(log);
}
