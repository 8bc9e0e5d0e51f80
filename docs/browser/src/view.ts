/** The 3D view: the robot, its ghost, and targets that are dragged with mouse, touch or keys. */
import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, GridHelper, Group, HemisphereLight, Mesh,
  MeshBasicMaterial, MeshStandardMaterial, PerspectiveCamera, Plane, Quaternion, Raycaster, Scene, SphereGeometry, Vector2,
  Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Pack, RobotData } from "./data";
import type { Frame } from "./messages";

const GHOST = 0x7c5ce6, STEP = 0.02;

interface Ball { task: string; raw: Mesh; filtered: Mesh; planar: boolean }

export class View {
  readonly canvas = document.createElement("canvas");
  private scene = new Scene();
  private camera = new PerspectiveCamera(42, 1, 0.02, 60);
  private renderer: WebGLRenderer;
  private controls: OrbitControls;
  private links: Group[] = [];
  private ghosts: Group[] = [];
  private balls = new Map<string, Ball>();
  private dragged: { ball: Ball; plane: Plane; offset: Vector3; id: number } | null = null;
  private size = 1;
  private planned = 0;
  private fitted = false;
  /** Called with the place (m) to which the target of a task is moved. */
  onMove: (task: string, place: number[]) => void = () => {};

  constructor(robot: Pack<RobotData>, colours: Record<string, string>, private planar: boolean, private draggable: Set<string>) {
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, alpha: true });
    this.camera.up.set(0, 0, 1);
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", "The robot. Arrow keys and Page Up, Page Down move the target by 2 cm; with Shift " +
      "the arrow keys turn the camera; plus and minus move it closer or away.");
    this.scene.add(new HemisphereLight(0xffffff, 0x8899aa, 1.6), new AmbientLight(0xffffff, 0.35));
    const sun = new DirectionalLight(0xffffff, 1.8);
    sun.position.set(2, 1, 4);
    const grid = new GridHelper(4, 16, 0x9aa4b0, 0xc9d0d8);
    grid.rotation.x = Math.PI / 2;
    grid.position.z = -0.002;
    this.scene.add(sun, grid);
    this.links = this.built(robot, null);
    this.ghosts = this.built(robot, GHOST);
    for (const each of this.ghosts) each.visible = false;
    this.size = robot.told.bodies.reduce((total, body) => total + Math.hypot(...body.pos), 0);
    this.controls = new OrbitControls(this.camera, this.canvas);
    const middle = planar ? new Vector3(0.35 * this.size, 0, 0) : new Vector3(0.12 * this.size, 0, 0.4 * this.size);
    const from = planar ? new Vector3(0.1, -0.5, 1.5) : new Vector3(1.25, 0.95, 0.6);
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(from, (planar ? 1.1 : 0.8) * this.size);
    this.controls.addEventListener("change", () => this.draw());
    this.controls.update();
    for (const [task, colour] of Object.entries(colours)) this.balls.set(task, this.ball(task, colour));
    this.canvas.addEventListener("pointerdown", (event) => this.grab(event), { capture: true });
    this.canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const name of ["pointerup", "pointercancel"] as const) this.canvas.addEventListener(name, (event) => this.release(event));
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.fit()).observe(this.canvas);
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
    const radius = 0.035 * Math.max(0.6, this.size);
    const raw = new Mesh(new SphereGeometry(radius, 24, 16), new MeshStandardMaterial({ color: colour, transparent: true, opacity: 0.75 }));
    const filtered = new Mesh(new SphereGeometry(0.45 * radius, 16, 12), new MeshBasicMaterial({ color: colour }));
    raw.visible = filtered.visible = false;
    this.scene.add(raw, filtered);
    return { task, raw, filtered, planar: this.planar };
  }

  show(frame: Frame): void {
    const place = (groups: Group[], poses: Float32Array): void => groups.forEach((group, k) => {
      const [x, y, z, w, i, j, l] = poses.subarray(7 * k, 7 * k + 7);
      group.position.set(x, y, z);
      group.quaternion.copy(new Quaternion(i, j, l, w));
    });
    place(this.links, frame.poses);
    for (const each of this.ghosts) each.visible = frame.ghost !== null;
    if (frame.ghost) place(this.ghosts, frame.ghost);
    this.draw();
  }

  /** Where a target is, and where it was dragged to, m. */
  place(task: string, filtered: number[], raw: number[]): void {
    const ball = this.balls.get(task);
    if (!ball) return;
    ball.raw.visible = ball.filtered.visible = true;
    ball.raw.position.set(raw[0], raw[1], raw[2]);
    ball.filtered.position.set(filtered[0], filtered[1], filtered[2]);
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

  private ray(event: PointerEvent): Raycaster {
    const box = this.canvas.getBoundingClientRect(), ray = new Raycaster();
    const at = new Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    ray.setFromCamera(at, this.camera);
    return ray;
  }

  pixel(task: string): [number, number] {
    const at = this.balls.get(task)!.raw.position.clone().project(this.camera), box = this.canvas.getBoundingClientRect();
    return [box.left + (0.5 + 0.5 * at.x) * box.width, box.top + (0.5 - 0.5 * at.y) * box.height];
  }

  private grab(event: PointerEvent): void {
    const ray = this.ray(event), reach = event.pointerType === "touch" ? 3 : 1.8;
    const near = [...this.balls.values()].filter((ball) => ball.raw.visible && this.draggable.has(ball.task) &&
      ray.ray.distanceToPoint(ball.raw.position) < reach * (ball.raw.geometry as SphereGeometry).parameters.radius);
    if (!near.length) return;
    const ball = near[0], normal = ball.planar ? new Vector3(0, 0, 1) : this.camera.getWorldDirection(new Vector3());
    const plane = new Plane().setFromNormalAndCoplanarPoint(normal, ball.raw.position);
    const hit = ray.ray.intersectPlane(plane, new Vector3()) ?? ball.raw.position;
    this.dragged = { ball, plane, offset: ball.raw.position.clone().sub(hit), id: event.pointerId };
    this.controls.enabled = false;
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true });
    event.stopImmediatePropagation();
    event.preventDefault();
  }

  private drag(event: PointerEvent): void {
    if (!this.dragged || event.pointerId !== this.dragged.id) return;
    const hit = this.ray(event).ray.intersectPlane(this.dragged.plane, new Vector3());
    if (hit) this.onMove(this.dragged.ball.task, hit.add(this.dragged.offset).toArray());
  }

  private release(event: PointerEvent): void {
    if (event.pointerId !== this.dragged?.id) return;
    this.dragged = null;
    this.controls.enabled = true;
  }

  private key(event: KeyboardEvent): void {
    const moves: Record<string, [number, number, number]> = { ArrowLeft: [0, -1, 0], ArrowRight: [0, 1, 0], ArrowUp: [-1, 0, 0],
      ArrowDown: [1, 0, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1] };
    const flat: Record<string, [number, number, number]> = { ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0] };
    const move = (this.planar ? flat : moves)[event.key], ball = [...this.balls.values()].find((each) => each.raw.visible && this.draggable.has(each.task));
    const offset = this.camera.position.clone().sub(this.controls.target);
    if (event.shiftKey && event.key.startsWith("Arrow")) {
      const across = event.key === "ArrowLeft" ? -0.15 : event.key === "ArrowRight" ? 0.15 : 0;
      const axis = across ? new Vector3(0, 0, 1) : new Vector3(0, 0, 1).cross(offset).normalize();
      offset.applyAxisAngle(axis, across || (event.key === "ArrowUp" ? -0.1 : 0.1));
      this.camera.position.copy(this.controls.target).add(offset);
    } else if (event.key === "+" || event.key === "-") {
      this.camera.position.copy(this.controls.target).addScaledVector(offset, event.key === "+" ? 0.9 : 1.1);
    } else if (move && ball) {
      this.onMove(ball.task, ball.raw.position.toArray().map((value, a) => value + STEP * move[a]));
    } else return;
    this.controls.update();
    event.preventDefault();
  }
}
