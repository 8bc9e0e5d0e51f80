/** The 3D view: the robot, its ghost, and targets that are dragged with mouse, touch or keys. */
import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, GridHelper, Group, HemisphereLight, Mesh,
  MeshBasicMaterial, MeshStandardMaterial, PerspectiveCamera, Scene, SphereGeometry, Vector3, WebGLRenderer,
} from "three";
import { DragControls } from "three/addons/controls/DragControls.js";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Pack, RobotData } from "./data";
import type { Frame } from "./messages";
import { element } from "./panel";

const GHOST = 0x7c5ce6, STEP = 0.02;
type Moves = Record<string, [number, number, number]>;
const MOVES: Moves = { ArrowLeft: [0, -1, 0], ArrowRight: [0, 1, 0], ArrowUp: [-1, 0, 0], ArrowDown: [1, 0, 0],
  PageUp: [0, 0, 1], PageDown: [0, 0, -1] };
const FLAT: Moves = { ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0] };

/** The ball of a task: where its target is, and in what cannot be seen but grasped, where it was dragged to. */
interface Ball { task: string; raw: Mesh; filtered: Mesh }

export class View {
  readonly canvas = element("canvas", { tabIndex: 0, role: "application", ariaLabel: "The robot. Arrow keys and Page Up, " +
    "Page Down move the target by 2 cm; with Shift the arrow keys turn the camera; plus and minus move it closer or away." });
  private scene = new Scene();
  private camera = new PerspectiveCamera(42, 1, 0.02, 60);
  private renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true });
  private controls: OrbitControls;
  private dragged = new DragControls([], this.camera, this.canvas);
  private links: Group[];
  private ghosts: Group[];
  private balls = new Map<string, Ball>();
  private planar: boolean;
  private size: number;
  private planned = 0;
  private fitted = false;

  /** onMove is called with the place (m) to which the target of a task is moved. */
  constructor(robot: Pack<RobotData>, private onMove: (task: string, place: number[]) => void) {
    const { canvas, scene, camera } = this, { bodies } = robot.told;
    const planar = this.planar = bodies.every((body) => Math.abs(body.pos[2]) < 1e-6);
    const size = this.size = bodies.reduce((total, body) => total + Math.hypot(...body.pos), 0);
    const sun = new DirectionalLight(0xffffff, 1.8), grid = new GridHelper(4, 16, 0x9aa4b0, 0xc9d0d8);
    sun.position.set(2, 1, 4);
    grid.rotation.x = Math.PI / 2;
    grid.position.z = -0.002;
    scene.add(new HemisphereLight(0xffffff, 0x8899aa, 1.6), new AmbientLight(0xffffff, 0.35), sun, grid);
    this.links = this.built(robot, null);
    this.ghosts = this.built(robot, GHOST);
    for (const each of this.ghosts) each.visible = false;
    camera.up.set(0, 0, 1);
    const controls = this.controls = new OrbitControls(camera, canvas);
    controls.target.copy(planar ? new Vector3(0.35 * size, 0, 0) : new Vector3(0.12 * size, 0, 0.4 * size));
    const from = planar ? new Vector3(0.1, -0.5, 1.5) : new Vector3(1.25, 0.95, 0.6);
    camera.position.copy(controls.target).addScaledVector(from, (planar ? 1.1 : 0.8) * size);
    controls.addEventListener("change", () => this.draw());
    controls.update();
    this.dragged.recursive = false;
    this.dragged.addEventListener("dragstart", () => {
      controls.enabled = false;
      canvas.focus({ preventScroll: true });
    });
    this.dragged.addEventListener("drag", ({ object }) => this.drag(object as Mesh));
    this.dragged.addEventListener("dragend", () => { controls.enabled = true; });
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.fit()).observe(canvas);
  }

  private built(robot: Pack<RobotData>, colour: number | null): Group[] {
    const groups = robot.told.bodies.map(() => new Group()), base = new Group();
    for (const shape of robot.told.shapes) {
      const points = robot.piece(shape.vertices), faces = robot.piece(shape.faces), geometry = new BufferGeometry();
      const grid = new Int16Array(points.buffer, points.byteOffset, points.byteLength / 2);
      geometry.setAttribute("position", new BufferAttribute(Float32Array.from(grid, (each) => each * shape.grid), 3));
      geometry.setIndex(new BufferAttribute(shape.wide ? new Uint32Array(faces.buffer, faces.byteOffset, faces.byteLength / 4) :
        new Uint16Array(faces.buffer, faces.byteOffset, faces.byteLength / 2), 1));
      geometry.computeVertexNormals();
      const [r, g, b] = shape.colour, own = new Color().setRGB(r / 255, g / 255, b / 255, "srgb");
      const material = new MeshStandardMaterial({ color: colour ?? own, roughness: 0.6, metalness: 0.1,
        transparent: colour !== null, opacity: colour === null ? 1 : 0.35, depthWrite: colour === null });
      if (shape.joint || colour === null) (shape.joint ? groups[shape.joint - 1] : base).add(new Mesh(geometry, material));
    }
    this.scene.add(...groups, base);
    return groups;
  }

  private ball(task: string, colour: string): Ball {
    const radius = 0.035 * Math.max(0.6, this.size), reach = matchMedia("(pointer: coarse)").matches ? 3 : 1.8;
    const raw = new Mesh(new SphereGeometry(reach * radius), new MeshBasicMaterial({ visible: false }));
    raw.add(new Mesh(new SphereGeometry(radius, 24, 16), new MeshStandardMaterial({ color: colour, transparent: true, opacity: 0.75 })));
    const filtered = new Mesh(new SphereGeometry(0.45 * radius, 16, 12), new MeshBasicMaterial({ color: colour }));
    const ball = { task, raw, filtered };
    this.scene.add(raw, filtered);
    this.dragged.objects.push(raw);
    this.balls.set(task, ball);
    return ball;
  }

  show(frame: Frame): void {
    const place = (groups: Group[], poses: Float32Array): void => groups.forEach((group, k) => {
      const [x, y, z, w, i, j, l] = poses.subarray(7 * k, 7 * k + 7);
      group.position.set(x, y, z);
      group.quaternion.set(i, j, l, w);
    });
    place(this.links, frame.poses);
    for (const each of this.ghosts) each.visible = frame.ghost !== null;
    if (frame.ghost) place(this.ghosts, frame.ghost);
    this.draw();
  }

  /** Where a target is, and where it was dragged to, m. */
  place(task: string, colour: string, filtered: number[], raw: number[]): void {
    const ball = this.balls.get(task) ?? this.ball(task, colour);
    ball.raw.position.fromArray(raw);
    ball.filtered.position.fromArray(filtered);
    this.draw();
  }

  private draw(): void {
    this.planned ||= requestAnimationFrame(() => {
      this.planned = 0;
      this.renderer.render(this.scene, this.camera);
    });
  }

  private fit(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    // A narrow picture is seen from farther away, so that the arm's reach fits into it.
    if (!this.fitted && width < height * 1.2) this.camera.position.sub(this.controls.target).multiplyScalar((1.2 * height) / width).add(this.controls.target);
    this.fitted = true;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  pixel(task: string): [number, number] {
    const at = this.balls.get(task)!.raw.position.clone().project(this.camera), box = this.canvas.getBoundingClientRect();
    return [box.left + (0.5 + 0.5 * at.x) * box.width, box.top + (0.5 - 0.5 * at.y) * box.height];
  }

  /** A ball was moved in a plane before the camera; that of a planar arm goes on along the camera's ray to its own plane. */
  private drag({ position }: Mesh): void {
    const { task, filtered } = [...this.balls.values()].find((each) => each.raw.position === position)!;
    const eye = this.camera.position, ray = position.clone().sub(eye);
    if (this.planar) position.copy(eye).addScaledVector(ray, (filtered.position.z - eye.z) / ray.z);
    this.onMove(task, position.toArray());
  }

  private key(event: KeyboardEvent): void {
    const { controls, planar } = this, [grasped] = this.dragged.objects;
    const ball = [...this.balls.values()].find(({ raw }) => raw === grasped);
    const move = (planar ? FLAT : MOVES)[event.key], arrow = move && event.key.startsWith("Arrow");
    if (event.shiftKey && arrow) {
      if (MOVES[event.key][1]) controls.rotateLeft(-0.15 * MOVES[event.key][1]);
      else controls.rotateUp(-0.1 * MOVES[event.key][0]);
    } else if (event.key === "+") controls.dollyIn(0.9);
    else if (event.key === "-") controls.dollyOut(0.9);
    else if (move && ball) this.onMove(ball.task, ball.raw.position.toArray().map((value, a) => value + STEP * move[a]));
    else return;
    controls.update();
    event.preventDefault();
  }
}
