/** The 3D view: the robot, its ghost, objects, and targets that the user drags with mouse, touch or keys. */
import {
  AmbientLight, BoxGeometry, BufferAttribute, BufferGeometry, CylinderGeometry, DirectionalLight, GridHelper, Group,
  HemisphereLight, Mesh, MeshBasicMaterial, MeshLambertMaterial, Object3D, PerspectiveCamera, Scene, SphereGeometry, Vector3,
  WebGLRenderer,
} from "three";
import { DragControls } from "three/addons/controls/DragControls.js";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { pieceOf, type Pack, type RobotData, type SceneData, type Thing } from "./data";
import { AXES, LEVELS, element } from "./panel";
import type { Frame } from "./worker";

const GHOST = 0x7c5ce6, OBJECT = 0x9aa4b0, STEP = 0.02;
type Moves = Record<string, [number, number, number]>;
const MOVES: Moves = { ArrowLeft: [0, -1, 0], ArrowRight: [0, 1, 0], ArrowUp: [-1, 0, 0], ArrowDown: [1, 0, 0],
  PageUp: [0, 0, 1], PageDown: [0, 0, -1] };
const FLAT: Moves = { ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0] };

export class View {
  readonly canvas = element("canvas", { tabIndex: 0, role: "application", ariaLabel: "The robot. Arrow keys and Page Up, " +
    "Page Down move the target by 2 cm; with Shift the arrow keys turn the camera; plus and minus move the camera closer or away." });
  private scene = new Scene();
  private camera = new PerspectiveCamera(42, 1, 0.02, 60);
  private renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true });
  private controls = new OrbitControls(this.camera, this.canvas);
  private dragged = new DragControls([], this.camera, this.canvas);
  private links: Group[];
  private ghosts: Group[];
  private objects: Object3D[];
  /** For each task: `filtered`, a ball at its target, and `raw`, the object that the user drags, at the dragged position. */
  private balls = new Map<string, { raw: Mesh; filtered: Mesh }>();
  private planned = 0;
  private fitted = false;

  /** onMove is called with a task and the position (m) to which its target is moved. */
  constructor(private robot: Pack<RobotData>, private told: SceneData, private onMove: (task: string, place: number[]) => void) {
    const { canvas, scene, camera, controls, dragged } = this, { planar, reach } = robot.told;
    const sun = new DirectionalLight(0xffffff, 1.8), grid = new GridHelper(4, 16, 0x9aa4b0, 0xc9d0d8);
    sun.position.set(2, 1, 4);
    grid.rotation.x = Math.PI / 2;
    grid.position.z = -0.002;
    this.links = this.built();
    this.ghosts = this.links.map((link) => ghostOf(link));
    this.objects = told.objects.map(solid);
    scene.add(new HemisphereLight(0xffffff, 0x8899aa, 1.6), new AmbientLight(0xffffff, 0.35), sun, grid, ...this.links,
      ...this.ghosts, ...this.objects);
    put(this.links, told.poses);
    put(this.objects, told.objects.flatMap(({ pose }) => pose));
    camera.up.set(0, 0, 1);
    controls.target.copy(planar ? new Vector3(0.35, 0, 0) : new Vector3(0.12, 0, 0.4)).multiplyScalar(reach);
    const from = planar ? new Vector3(0.1, -0.5, 1.5) : new Vector3(1.25, 0.95, 0.6);
    camera.position.copy(controls.target).addScaledVector(from, (planar ? 1.1 : 0.8) * reach);
    controls.addEventListener("change", () => this.draw());
    controls.update();
    dragged.recursive = false;
    dragged.addEventListener("dragstart", () => {
      controls.enabled = false;
      canvas.focus({ preventScroll: true });
    });
    dragged.addEventListener("drag", ({ object }) => this.drag(object as Mesh));
    dragged.addEventListener("dragend", () => { controls.enabled = true; });
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("keydown", (event) => this.key(event));
    controls.keyRotateSpeed = 10;
    controls.listenToKeyEvents(canvas);
    new ResizeObserver(() => this.fit()).observe(canvas);
  }

  private built(): Group[] {
    const { robot } = this, groups = robot.told.joints.map(() => new Group());
    for (const shape of robot.told.shapes) {
      const points = pieceOf(robot, shape.vertices), faces = pieceOf(robot, shape.faces), geometry = new BufferGeometry();
      const grid = new Int16Array(points.buffer, points.byteOffset, points.byteLength / 2);
      geometry.setAttribute("position", new BufferAttribute(Float32Array.from(grid, (each) => each * shape.grid), 3));
      geometry.setIndex(new BufferAttribute(new Uint16Array(faces.buffer, faces.byteOffset, faces.byteLength / 2), 1));
      geometry.computeVertexNormals();
      (groups[shape.joint - 1] ?? this.scene).add(new Mesh(geometry, new MeshLambertMaterial({ color: shape.colour })));
    }
    return groups;
  }

  /** Adds the ball of a task. */
  private add(task: string): void {
    const radius = 0.035 * Math.max(0.6, this.robot.told.reach), reach = matchMedia("(pointer: coarse)").matches ? 3 : 1.8;
    const color = LEVELS[this.told.tasks.find(({ name }) => name === task)!.level % 6];
    const raw = new Mesh(new SphereGeometry(reach * radius), new MeshBasicMaterial({ visible: false }));
    raw.add(new Mesh(new SphereGeometry(radius, 24, 16), new MeshLambertMaterial({ color, transparent: true, opacity: 0.75 })));
    const filtered = new Mesh(new SphereGeometry(0.45 * radius, 16, 12), new MeshBasicMaterial({ color }));
    raw.name = task;
    this.scene.add(raw, filtered);
    this.dragged.objects.push(raw);
    this.balls.set(task, { raw, filtered });
  }

  show(frame: Frame): void {
    put(this.links, frame.poses);
    put(this.objects, frame.objects);
    for (const each of this.ghosts) each.visible = frame.ghost !== null;
    if (frame.ghost) put(this.ghosts, frame.ghost);
    this.draw();
  }

  /** Draws a target (m; value: filtered, raw: as dragged). Along axes that its task does not control, it follows the hand. */
  place(task: string, value: ArrayLike<number>, raw: number[] | undefined): void {
    const { frame, axes } = this.told.tasks.find(({ name }) => name === task)!;
    if (!frame) return;
    if (!this.balls.has(task)) this.add(task);
    const ball = this.balls.get(task)!, hand = new Vector3().fromArray(frame.pos);
    this.links[frame.joint - 1]?.localToWorld(hand);
    AXES.forEach((axis, a) => {
      const place = axes.indexOf(axis), filtered = place < 0 ? hand.getComponent(a) : value[place];
      ball.filtered.position.setComponent(a, filtered);
      ball.raw.position.setComponent(a, (place < 0 ? undefined : raw?.[a]) ?? filtered);
    });
    this.draw();
  }

  private draw(): void {
    this.planned ||= requestAnimationFrame(() => {
      this.planned = 0;
      this.renderer.render(this.scene, this.camera);
    });
  }

  private fit(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas, { camera, controls } = this;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    // In a narrow picture the camera is farther away, so that the arm's reach fits into the picture.
    if (!this.fitted && width < height * 1.2) camera.position.lerp(controls.target, 1 - (1.2 * height) / width);
    this.fitted = true;
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    this.draw();
  }

  pixel(task: string): [number, number] {
    const at = this.balls.get(task)!.raw.position.clone().project(this.camera), box = this.canvas.getBoundingClientRect();
    return [box.left + (0.5 + 0.5 * at.x) * box.width, box.top + (0.5 - 0.5 * at.y) * box.height];
  }

  /** Reports a ball that was moved parallel to the picture. For a planar arm it is projected to the arm's plane along the ray. */
  private drag({ name, position }: Mesh): void {
    const eye = this.camera.position, ray = position.clone().sub(eye), own = this.balls.get(name)!.filtered.position.z;
    if (this.robot.told.planar) position.copy(eye).addScaledVector(ray, (own - eye.z) / ray.z);
    this.onMove(name, position.toArray());
  }

  /** Moves the target, or the camera with + and -; with Shift, OrbitControls handles the arrow keys. */
  private key(event: KeyboardEvent): void {
    const { controls, robot } = this, [ball] = this.dragged.objects;
    const move = event.shiftKey ? undefined : (robot.told.planar ? FLAT : MOVES)[event.key];
    if (move && ball) this.onMove(ball.name, ball.position.toArray().map((value, a) => value + STEP * move[a]));
    else if (event.key === "+") controls.dollyIn(0.9);
    else if (event.key === "-") controls.dollyOut(0.9);
    else return;
    controls.update();
    event.preventDefault();
    event.stopImmediatePropagation();
  }
}

/** Moves objects to the poses of their bodies: position and quaternion x y z w of each. */
function put(things: Object3D[], poses: ArrayLike<number>): void {
  things.forEach((each, k) => {
    each.position.fromArray(poses, 7 * k);
    each.quaternion.fromArray(poses, 7 * k + 3);
  });
}

/** Returns a transparent violet copy of a link. */
function ghostOf(link: Group): Group {
  const found = link.clone(), given = { color: GHOST, transparent: true, opacity: 0.35, depthWrite: false };
  for (const each of found.children as Mesh[]) each.material = new MeshLambertMaterial(given);
  found.visible = false;
  return found;
}

function solid({ kind, size: [x, y, z] }: Thing): Mesh {
  const geometry = kind === "box" ? new BoxGeometry(2 * x, 2 * y, 2 * z) : kind === "sphere" ? new SphereGeometry(x, 32, 24) :
    new CylinderGeometry(x, x, 2 * y, 32).rotateX(Math.PI / 2);
  return new Mesh(geometry, new MeshLambertMaterial({ color: OBJECT }));
}
