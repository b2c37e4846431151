import * as THREE from "three";
import { mergeVertices } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import type { Connection } from "../core/connection";
import { Change } from "../core/change";
import { frames, g } from "../core/kinematics";
import { Timeline } from "../core/timeline";
import { movePoint, originOf } from "../core/transform";
import type { Palette } from "./colours";
import { Figure, type Bodies } from "./figure";
import type { InWorld } from "./scene";
import type { Stage } from "./stage";

const OPACITY = 0.32;
const BESIDE = 0.004; // [m] a link of a ghost this close to the arm is hidden, as the base is
export const COINCIDE = 0.02; // [rad, m] of a joint: a ghost this close to the arm would only tint it
const OUTLINE = 2.5; // [px] width of an outline

/** The drawing of a ghost: its figures and their colours. */
interface Drawing {
  figures: Figure[];
  colours: THREE.Color[];
}

/** Draws a translucent arm. Only its nearest surface is drawn, so that hidden surfaces do not clutter it. */
function clear(_stage: Stage, bodies: Bodies): Drawing {
  const depth = new THREE.MeshBasicMaterial({ colorWrite: false, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
  const seen = new THREE.MeshLambertMaterial({ transparent: true, opacity: OPACITY, depthWrite: false, side: THREE.DoubleSide });
  return { figures: [depth, seen].map((material, order) => new Figure(bodies, { material, order: 1 + order })), colours: [seen.color] };
}

/** Draws the outline of an arm, also where another one is before it: its surface marks the stencil, and a wider one is drawn beside the marks.
 * `stencilRef`: the mark, for each outline another. */
function outline(stage: Stage, bodies: Bodies, stencilRef = 1): Drawing {
  const resolution = { value: new THREE.Vector2() };
  const common = { depthTest: false, depthWrite: false, side: THREE.DoubleSide, stencilWrite: true, stencilRef };
  const mark = new THREE.MeshBasicMaterial({ ...common, colorWrite: false, stencilZPass: THREE.ReplaceStencilOp });
  const edge = new THREE.MeshBasicMaterial({ ...common, stencilFunc: THREE.NotEqualStencilFunc });
  edge.onBeforeCompile = (shader) => {
    shader.uniforms.resolution = resolution;
    shader.vertexShader = `uniform vec2 resolution;\n${shader.vertexShader}`.replace("#include <project_vertex>", `#include <project_vertex>
      vec2 away = (projectionMatrix * modelViewMatrix * vec4(normal, 0.0)).xy * resolution;
      if (length(away) > 0.0) gl_Position.xy += normalize(away) * ${(2 * OUTLINE).toFixed(1)} / resolution * gl_Position.w;`);
  };
  const known = new Map<THREE.BufferGeometry, THREE.BufferGeometry>();
  /** Returns a surface with one normal per corner, so that the wider surface has no gaps. */
  const surface = (from: THREE.BufferGeometry): THREE.BufferGeometry => {
    const bare = new THREE.BufferGeometry().setAttribute("position", from.getAttribute("position")).setIndex(from.index);
    const made = known.get(from) ?? mergeVertices(bare, 1e-5);
    if (!known.has(from)) made.computeVertexNormals();
    known.set(from, made);
    return made;
  };
  stage.beforeDraw.add(() => resolution.value.set(stage.width, stage.height));
  return { figures: [mark, edge].map((material, order) => new Figure(bodies, { material, order: 10 * stencilRef + order, surface })), colours: [edge.color] };
}

/** Draws a translucent arm with an outline. */
function filled(stage: Stage, bodies: Bodies): Drawing {
  const [inside, edge] = [clear(stage, bodies), outline(stage, bodies, 2)];
  return { figures: [...inside.figures, ...edge.figures], colours: [...inside.colours, ...edge.colours] };
}

/** A ghost: a second arm at other joints. It is made when it is first visible. */
export class Ghost {
  visible = true;
  private readonly root = new THREE.Group();
  private drawing: Drawing | null = null;
  private readonly change = new Change();
  private readonly paint = (colours: Palette): void => this.drawing?.colours.forEach((one) => one.set(this.colour(colours)));

  /** `joints`: returns its joints at a time; null: hidden. */
  constructor(
    private readonly stage: Stage, private readonly bodies: Bodies, private readonly make: typeof clear, private readonly colour: (colours: Palette) => string,
    private readonly joints: (shown: InWorld) => number[] | null,
  ) {
    stage.scene.add(this.root);
    stage.onPaint.add(this.paint);
    this.root.visible = false;
  }

  hide(): void {
    if (this.root.visible) this.stage.change();
    this.root.visible = false;
    this.change.forget();
  }

  /** Shows the ghost, or hides it without joints or beside the arm. Returns the displayed joints. */
  show(shown: InWorld): number[] | null {
    const q = this.visible ? this.joints(shown) : null;
    if (!q || Math.max(...q.map((x, i) => Math.abs(x - shown.q[i]))) < COINCIDE) {
      this.hide();
      return null;
    }
    if (!this.change.to(`${q.map((x) => x.toFixed(4))} ${shown.q} ${shown.T_world_robot} ${shown.hand}`)) return q;
    if (!this.drawing) {
      this.drawing = this.make(this.stage, this.bodies);
      this.root.add(...this.drawing.figures.map((figure) => figure.root));
      this.paint(this.stage.colours);
    }
    const there = frames(this.bodies.model, q);
    for (const figure of this.drawing.figures) {
      figure.pose(there, shown.hand, shown.T_world_robot);
      there.forEach((T, i) => figure.showLink(i, T.some((x, k) => Math.abs(x - shown.frames[i][k]) > BESIDE)));
    }
    this.root.visible = true;
    this.stage.change();
    return q;
  }

  remove(): void {
    this.hide();
    this.root.removeFromParent();
    this.stage.onPaint.delete(this.paint);
  }
}

/** Returns the goal of the current motion as an outline; nothing at rest. */
export const goalView = (stage: Stage, bodies: Bodies): Ghost =>
  new Ghost(stage, bodies, outline, ({ goal }) => goal, ({ timeline, t }) => {
    const steered = timeline.locate(t)[0].motion.kind === "steered"; // a stream of targets has no goal of its own
    return steered || !timeline.moves(t) ? null : g(bodies.model, timeline, timeline.finishAfter(t));
  });

/** Returns the predicted arm beside the reported one, while the page follows the robot. */
export const predictionView = (stage: Stage, bodies: Bodies, follows: () => boolean): Ghost =>
  new Ghost(stage, bodies, clear, ({ predicted }) => predicted, ({ source: { preview }, now }) =>
    preview?.predicts && follows() ? g(bodies.model, preview.predicted, preview.shown(now)) : null);

/** Returns the arm that the robot's body has measured. */
export const measuredView = (stage: Stage, bodies: Bodies): Ghost =>
  new Ghost(stage, bodies, filled, ({ measured }) => measured, ({ measured }) => measured?.q ?? null);

interface Branch {
  ghost: Ghost;
  version: number;
  timeline: Timeline | null;
}

/** Shows the arm of other branches at the displayed time, each with the difference of its end. */
export class BranchView {
  visible = true;
  private readonly all = new Map<string, Branch>();

  constructor(private readonly stage: Stage, private readonly bodies: Bodies, private readonly connection: Connection) {}

  show(shown: InWorld): void {
    const rows: { row: { name: string; end: number; present?: boolean }; version: number }[] = shown.surveyed?.branches ?? [];
    const others = this.visible ? rows.filter(({ row }) => !row.present).slice(0, this.stage.colours.branches.length) : [];
    for (const [name, { ghost }] of this.all)
      if (!others.some(({ row }) => row.name === name)) {
        ghost.remove();
        this.stage.labels.remove(`branch ${name}`);
        this.all.delete(name);
      }
    others.forEach(({ row: { name, end }, version }, k) => {
      const { model } = this.bodies;
      const branch = this.all.get(name) ?? this.make(k);
      this.all.set(name, branch);
      if (branch.version !== version) this.fetch(name, version, branch);
      const q = branch.ghost.show(shown);
      if (!q) return this.stage.labels.remove(`branch ${name}`);
      const later = end - shown.timeline.end;
      const at = movePoint(shown.T_world_robot, originOf(frames(model, q)[q.length]));
      this.stage.labels.set(`branch ${name}`, "branch", `${name}: ${later < 0 ? "-" : "+"}${Math.abs(later).toFixed(1)} s`, at);
    });
  }

  /** Makes a branch in the k-th colour. */
  private make(k: number): Branch {
    const joints = ({ t }: InWorld): number[] | null => branch.timeline && g(this.bodies.model, branch.timeline, t);
    const branch: Branch = { ghost: new Ghost(this.stage, this.bodies, clear, ({ branches }) => branches[k], joints), version: -1, timeline: null };
    return branch;
  }

  private fetch(name: string, version: number, branch: Branch): void {
    branch.version = version;
    void this.connection.ask("at", { act: { kind: "ShowBranch", name } }).then((answer) => {
      if (answer.found?.kind !== "BranchShown") return void (branch.version = -1); // the branch is gone, or was requested again
      branch.timeline = new Timeline();
      branch.timeline.replace(answer.found.snapshot);
      this.stage.change();
    });
  }
}
