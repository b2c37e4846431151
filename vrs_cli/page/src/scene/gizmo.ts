import * as THREE from "three";
import { TransformControls } from "three/examples/jsm/controls/TransformControls.js";
import { Change } from "../core/change";
import { inverse, multiply, originOf, type Transform } from "../core/transform";
import { AXES } from "./colours";
import { matrixOf } from "./figure";
import type { InWorld } from "./scene";
import type { Stage } from "./stage";

const RELEASE = 400; // [ms] after the last key before the tool is released
const LIT_COLOUR = "#f0a020"; // colour of an arrow under the pointer
const LIT = 0.09; // of the reach: radius of the ball at a joint at its limit
const [STEP, TURN] = [0.005, Math.PI / 90]; // [m, rad] step of a key
const [SIZE, TOUCH_SIZE] = [0.85, 1.25]; // sizes of the arrows: their targets have 24 px, and 44 px for touch
const KEYS: Record<string, [axis: number, sign: number, turns: boolean]> = {
  ArrowRight: [0, 1, false], ArrowLeft: [0, -1, false], ArrowUp: [1, 1, false], ArrowDown: [1, -1, false], PageUp: [2, 1, false], PageDown: [2, -1, false],
  x: [0, 1, true], X: [0, -1, true], y: [1, 1, true], Y: [1, -1, true], z: [2, 1, true], Z: [2, -1, true],
};

/** The arrows and rings that drag the tool. `onDrag` receives the wishes. */
export class Gizmo {
  /** Called with the wished T_world_tool during a drag, and with null at its end. */
  onDrag: (wish: Transform | null) => void = () => {};
  /** Whether the gizmo may be visible: for users who may drive, while the page follows the robot. */
  enabled: () => boolean = () => false;
  /** Whether the arrows have the directions of the tool or of the world. */
  axes: "tool" | "world" = "tool";
  /** The possible motions of the gizmo. */
  motions: "both" | "move" | "turn" = "both";
  private readonly proxy = new THREE.Object3D();
  private readonly move: TransformControls;
  private readonly turn: TransformControls;
  private readonly ball: THREE.Mesh;
  private tool: Transform | null = null; // the last displayed T_world_tool
  private T_gizmo_tool: Transform | null = null; // during a drag
  private keyTimer = 0;
  private readonly arranged = new Change();
  private held = { text: "", joint: 0 };

  constructor(private readonly stage: Stage) {
    stage.scene.add(this.proxy);
    this.move = this.control("translate");
    this.turn = this.control("rotate");
    this.ball = new THREE.Mesh(new THREE.SphereGeometry(LIT * stage.reach, 24, 16), new THREE.MeshBasicMaterial({ color: "#d63a2e", transparent: true, opacity: 0.45, depthWrite: false }));
    this.ball.visible = false;
    stage.scene.add(this.ball);
  }

  private control(mode: "translate" | "rotate"): TransformControls {
    const made = new TransformControls(this.stage.camera, this.stage.view);
    made.setMode(mode);
    made.setSpace("local"); // the proxy itself has the directions of the world or the tool
    made.attach(this.proxy);
    made.enabled = false;
    made.setColors(AXES[0], AXES[1], AXES[2], LIT_COLOUR);
    made.showXYZE = made.showE = false; // a ring facing the viewer would be mistaken for that of an axis
    const fingers = matchMedia("(pointer: coarse)").matches;
    made.setSize((fingers ? TOUCH_SIZE : SIZE) * (mode === "rotate" ? 1 : 0.8));
    made.addEventListener("change", () => this.stage.change());
    made.addEventListener("axis-changed", () => this.oneAtATime(made));
    made.addEventListener("mouseDown", () => this.take());
    made.addEventListener("objectChange", () => this.wish());
    made.addEventListener("mouseUp", () => this.letGo());
    const helper = made.getHelper();
    helper.visible = false;
    this.stage.scene.add(helper);
    return made;
  }

  /** Whether it is being dragged. */
  get dragged(): boolean {
    return this.T_gizmo_tool !== null;
  }

  /** Disables the arrows while a ring is under the pointer, and the rings under an arrow. */
  private oneAtATime(active: TransformControls): void {
    const other = active === this.move ? this.turn : this.move;
    if (!this.dragged) other.enabled = other.getHelper().visible && active.axis === null;
  }

  /** Whether it is visible. */
  get seen(): boolean {
    return this.enabled() || this.dragged;
  }

  private take(): void {
    if (!this.tool) return;
    this.stage.controls.enabled = false;
    this.T_gizmo_tool = multiply(inverse(this.gizmo), this.tool);
  }

  private get gizmo(): Transform {
    this.proxy.updateMatrix();
    const e = this.proxy.matrix.elements;
    return Float64Array.of(e[0], e[4], e[8], e[12], e[1], e[5], e[9], e[13], e[2], e[6], e[10], e[14]);
  }

  private wish(): void {
    if (this.T_gizmo_tool) this.onDrag(multiply(this.gizmo, this.T_gizmo_tool));
  }

  private letGo(): void {
    if (this.T_gizmo_tool) this.wish();
    this.drop();
  }

  /** Ends a drag, also when the connection is lost. */
  drop(): void {
    this.stage.controls.enabled = true;
    if (this.dragged) this.onDrag(null);
    this.T_gizmo_tool = null;
    this.stage.change();
  }

  /**
   * Moves the tool by a key, and says whether it is one of its keys: arrows along X and Y, Page Up and Page Down along Z, x y z about the axes
   * (Shift: the other way round; Alt: a tenth).
   */
  key(event: KeyboardEvent): boolean {
    const found = KEYS[event.key];
    if (!found || !this.tool || !this.enabled() || event.ctrlKey || event.metaKey) return false;
    const [axis, sign, turns] = found;
    const step = sign * (turns ? TURN : STEP) * (event.altKey ? 0.1 : 1);
    if (!this.dragged) this.take();
    const unit = new THREE.Vector3().setComponent(axis, 1);
    if (turns) this.proxy.rotateOnAxis(unit, step);
    else this.proxy.translateOnAxis(unit, step);
    this.wish();
    window.clearTimeout(this.keyTimer);
    this.keyTimer = window.setTimeout(() => this.letGo(), RELEASE);
    return true;
  }

  /** Shows what holds the tool back: a text at the tool, and a ball at the joint at its limit (from 1; 0: none). */
  showHeld(text: string, joint: number): void {
    this.held = { text, joint };
    this.stage.change();
  }

  show({ T_world_tool, T_world_robot, frames }: InWorld): void {
    this.tool = T_world_tool;
    if (this.arranged.to(this.axes)) this.stage.change();
    for (const [control, other] of [[this.move, "turn"], [this.turn, "move"]] as const) {
      const on = this.seen && this.motions !== other;
      const helper = control.getHelper();
      if (helper.visible === on) continue;
      helper.visible = control.enabled = on;
      this.stage.change();
    }
    if (!this.dragged) {
      matrixOf(T_world_tool).decompose(this.proxy.position, this.proxy.quaternion, this.proxy.scale);
      if (this.axes === "world") this.proxy.quaternion.identity();
    }
    const { text, joint } = this.held;
    if (text) this.stage.labels.set("held", "held", text, originOf(T_world_tool));
    else this.stage.labels.remove("held");
    this.ball.visible = joint > 0;
    if (joint > 0) this.ball.position.set(...originOf(multiply(T_world_robot, frames[joint - 1])));
  }
}
