import * as THREE from "three";
import { mergeVertices } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import type { Connection } from "../core/connection";
import { frames, g, type Model } from "../core/kinematics";
import { Timeline } from "../core/timeline";
import { Figure, matrixOf, type Bodies } from "./figure";
import type { Labels } from "./labels";
import type { InWorld } from "./scene";
import type { Stage } from "./stage";

const OPACITY = 0.32;
const BESIDE = 0.004; // [m] of a link: one that stands nearer is not seen either, as that of the base never is
const COINCIDE = 0.02; // [rad, m] of a joint: a ghost that stands nearer would only tint the arm
const OUTLINE = 2.5; // [px] the width of an outline

/** An arm that is not there yet, or would be. It is made when it is first seen. */
abstract class Ghost {
  protected readonly root = new THREE.Group();
  protected made = false;
  private at = "";

  constructor(protected readonly stage: Stage, protected readonly bodies: Bodies) {
    stage.scene.add(this.root);
    this.root.visible = false;
  }

  /** Makes the figures it consists of. */
  protected abstract figures: Figure[];
  protected abstract make(): void;
  abstract paint(colour: string): void;

  hide(): void {
    if (this.root.visible) this.stage.change();
    this.root.visible = false;
    this.at = "";
  }

  /** Stands at these joints, or hides where the arm is there too. Returns whether it is seen. */
  stand(model: Model, q: number[], shown: InWorld): boolean {
    if (Math.max(...q.map((x, i) => Math.abs(x - shown.q[i]))) < COINCIDE) {
      this.hide();
      return false;
    }
    const wanted = `${q} ${shown.q} ${shown.T_world_robot} ${shown.hand}`;
    if (wanted === this.at) return true;
    this.at = wanted;
    if (!this.made) {
      this.made = true;
      this.make();
    }
    const there = frames(model, q);
    for (const figure of this.figures) {
      figure.pose(there, shown.hand, shown.T_world_robot);
      there.forEach((T, i) => figure.showLink(i, T.some((x, k) => Math.abs(x - shown.frames[i][k]) > BESIDE)));
    }
    this.root.visible = true;
    this.stage.change();
    return true;
  }

  remove(): void {
    this.hide();
    this.root.removeFromParent();
  }
}

/** An arm that is seen through. Its nearest surface alone is drawn, so that what lies behind does not show as clutter. */
export class ClearGhost extends Ghost {
  protected figures: Figure[] = [];
  private readonly depth = new THREE.MeshBasicMaterial({ colorWrite: false, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
  private readonly clear = new THREE.MeshLambertMaterial({ transparent: true, opacity: OPACITY, depthWrite: false, side: THREE.DoubleSide });

  protected make(): void {
    this.figures = [this.depth, this.clear].map((material, order) => new Figure(this.bodies, { material, order: 1 + order }));
    this.root.add(...this.figures.map((figure) => figure.root));
  }

  paint(colour: string): void {
    this.clear.color.set(colour);
  }
}

const OUTLINE_VERTEX = /* glsl */ `
  uniform vec2 resolution;
  uniform float width;
  void main() {
    vec4 at = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    vec2 out_ = (projectionMatrix * modelViewMatrix * vec4(normal, 0.0)).xy * resolution;
    if (width > 0.0 && length(out_) > 0.0) at.xy += normalize(out_) * 2.0 * width / resolution * at.w;
    gl_Position = at;
  }`;
const OUTLINE_FRAGMENT = /* glsl */ `
  uniform vec3 colour;
  void main() {
    gl_FragColor = vec4(colour, 1.0);
    #include <colorspace_fragment>
  }`;

/** The outline of an arm, also where another one is before it: its surface marks the stencil, and a wider one is drawn beside the marks. */
export class OutlineGhost extends Ghost {
  protected figures: Figure[] = [];
  private readonly uniforms = { resolution: { value: new THREE.Vector2() }, width: { value: OUTLINE }, colour: { value: new THREE.Color() } };
  private readonly smooth = new Map<THREE.BufferGeometry, THREE.BufferGeometry>();

  protected make(): void {
    const common = { vertexShader: OUTLINE_VERTEX, fragmentShader: OUTLINE_FRAGMENT, depthTest: false, depthWrite: false, side: THREE.DoubleSide, stencilWrite: true, stencilRef: 1 };
    const mark = new THREE.ShaderMaterial({ ...common, uniforms: { ...this.uniforms, width: { value: 0 } }, colorWrite: false, stencilZPass: THREE.ReplaceStencilOp });
    const edge = new THREE.ShaderMaterial({ ...common, uniforms: this.uniforms, stencilFunc: THREE.NotEqualStencilFunc });
    const surface = (of: THREE.BufferGeometry): THREE.BufferGeometry => this.smoothed(of);
    this.figures = [mark, edge].map((material, order) => new Figure(this.bodies, { material, order: 10 + order, surface }));
    this.stage.beforeDraw.add(() => this.uniforms.resolution.value.set(this.stage.width, this.stage.height));
    this.root.add(...this.figures.map((figure) => figure.root));
  }

  /** Returns the surface with one normal at each corner, so that the wider one has no gaps. */
  private smoothed(from: THREE.BufferGeometry): THREE.BufferGeometry {
    const known = this.smooth.get(from);
    if (known) return known;
    const bare = new THREE.BufferGeometry().setAttribute("position", from.getAttribute("position"));
    bare.setIndex(from.index);
    const made = mergeVertices(bare, 1e-5);
    made.computeVertexNormals();
    this.smooth.set(from, made);
    return made;
  }

  paint(colour: string): void {
    this.uniforms.colour.value.set(colour);
  }
}

/** Returns when the motion under way at t ends, or when the last one has ended. */
export function finishAfter(timeline: Timeline, t: number): number {
  const [{ motion, start }] = timeline.locate(t);
  const { segments } = timeline;
  let [low, high] = [0, segments.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (segments[middle].start <= start) low = middle;
    else high = middle - 1;
  }
  while (low + 1 < segments.length && segments[low + 1].motion.number === motion.number) low++;
  return segments[low].finish;
}

/** Whether the robot moves at t. */
export function movesAt(timeline: Timeline, t: number): boolean {
  const [segment] = timeline.locate(t);
  return segment.phase !== "rest" && t < segment.finish && t >= segment.start;
}

/** Shows where the motion under way ends, as an outline; nothing at rest, and where the arm is there already. */
export class GoalView {
  visible = true;
  private readonly ghost: OutlineGhost;
  private known: { key: string; timeline: Timeline; q: number[] } | null = null;

  constructor(stage: Stage, bodies: Bodies, private readonly model: Model) {
    this.ghost = new OutlineGhost(stage, bodies);
    const paint = (): void => this.ghost.paint(stage.colours.goal);
    stage.onPaint.add(paint);
    paint();
  }

  show(shown: InWorld): void {
    const { timeline, t } = shown;
    const steered = timeline.locate(t)[0].motion.kind === "steered"; // a stream of targets has no goal of its own
    if (!this.visible || steered || !movesAt(timeline, t)) return this.ghost.hide();
    const end = finishAfter(timeline, t);
    const key = `${end} ${timeline.version} ${timeline.number}`;
    if (this.known?.key !== key || this.known.timeline !== timeline) this.known = { key, timeline, q: g(this.model, timeline, end) };
    this.ghost.stand(this.model, this.known.q, shown);
  }
}

/** Shows the arm as it is expected, beside the one that is reported: while the robot is followed. */
export class PredictionView {
  private readonly ghost: ClearGhost;

  constructor(stage: Stage, bodies: Bodies, private readonly model: Model) {
    this.ghost = new ClearGhost(stage, bodies);
    const paint = (): void => this.ghost.paint(stage.colours.predicted);
    stage.onPaint.add(paint);
    paint();
  }

  show(shown: InWorld, follows: boolean): void {
    const { preview } = shown.source;
    if (!preview?.predicts || !follows) return this.ghost.hide();
    this.ghost.stand(this.model, g(this.model, preview.predicted, preview.shown(shown.now)), shown);
  }
}

interface Branch {
  ghost: ClearGhost;
  version: number;
  timeline: Timeline | null;
}

/** Shows the arm as other branches have it at the time that is shown, each with how much later it ends. */
export class BranchView {
  visible = true;
  private readonly all = new Map<string, Branch>();

  constructor(private readonly stage: Stage, private readonly labels: Labels, private readonly bodies: Bodies, private readonly model: Model, private readonly connection: Connection) {
    stage.onPaint.add(() => [...this.all.values()].forEach(({ ghost }, k) => ghost.paint(stage.colours.branches[k % 3])));
  }

  show(shown: InWorld): void {
    const { branches } = this.stage.colours;
    const rows: { row: { name: string; end: number; present?: boolean }; version: number }[] = shown.surveyed?.branches ?? [];
    const others = this.visible ? rows.filter(({ row }) => !row.present).slice(0, branches.length) : [];
    for (const [name, { ghost }] of this.all)
      if (!others.some(({ row }) => row.name === name)) {
        ghost.remove();
        this.labels.remove(`branch ${name}`);
        this.all.delete(name);
      }
    others.forEach(({ row, version }, k) => {
      const branch = this.all.get(row.name) ?? { ghost: new ClearGhost(this.stage, this.bodies), version: -1, timeline: null };
      if (!this.all.has(row.name)) branch.ghost.paint(branches[k]);
      this.all.set(row.name, branch);
      if (branch.version !== version) this.fetch(row.name, version, branch);
      if (branch.timeline) this.stand(row, branch.ghost, branch.timeline, shown);
    });
  }

  private stand(row: { name: string; end: number }, ghost: ClearGhost, timeline: Timeline, shown: InWorld): void {
    const q = g(this.model, timeline, shown.t);
    if (!ghost.stand(this.model, q, shown)) return this.labels.remove(`branch ${row.name}`);
    const later = row.end - shown.timeline.end;
    const flange = frames(this.model, q)[q.length];
    const at = new THREE.Vector3(flange[3], flange[7], flange[11]).applyMatrix4(matrixOf(shown.T_world_robot));
    this.labels.set(`branch ${row.name}`, "branch", `${row.name}: ${later < 0 ? "-" : "+"}${Math.abs(later).toFixed(1)} s`, at.toArray());
  }

  private fetch(name: string, version: number, branch: Branch): void {
    branch.version = version;
    void this.connection.ask("at", { act: { kind: "ShowBranch", name } }).then((answer) => {
      if (answer.found?.kind !== "BranchShown") return void (branch.version = -1); // it is gone, or is asked for again
      branch.timeline = new Timeline();
      branch.timeline.replace(answer.found.snapshot);
      this.stage.change();
    });
  }
}
