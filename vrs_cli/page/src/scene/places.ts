import * as THREE from "three";
import { Change } from "../core/change";
import type { Message } from "../core/connection";
import { toolFrame, type Model } from "../core/kinematics";
import { inverse, multiply, originOf, transformOf, type Point, type Transform } from "../core/transform";
import { AxesCloud, Lines, type Piece } from "./lines";
import { gather } from "./path";
import type { InWorld } from "./scene";
import type { Stage } from "./stage";

const LONG = 0.055; // of the reach: length of the axes
const NEAR = 0.01; // of the reach: places this close share one label
const DASH = 0.02; // of the reach: length of dashes and gaps of lines that the arm cannot follow
const BALL = 0.02; // of the reach: radius of balls
const WIDTH = 3; // [px] width of lines
const MAX_CHARS = 300; // maximum length of the text of a picture

/** The named locations of the robot: small frames with their names. A precision point is where its joints bring the tool. */
export class PlacesView {
  readonly root = new THREE.Group();
  private readonly axes: AxesCloud;
  private readonly drawn = new Change();

  constructor(private readonly stage: Stage, private readonly model: Model) {
    this.axes = new AxesCloud(LONG * stage.reach);
    this.root.add(this.axes.root);
  }

  set visible(on: boolean) {
    this.root.visible = on;
    this.drawn.forget();
    if (!on) this.stage.labels.remove("place ");
  }

  show({ surveyed }: InWorld): void {
    const rows: Message[] | undefined = surveyed?.places?.rows;
    if (!this.root.visible || !rows || !this.drawn.to([rows, surveyed!.base, surveyed!.tool])) return;
    const placed = rows.flatMap((row) => {
      const T = this.pose(row, surveyed!);
      return T ? [{ text: row.name as string, T, at: originOf(T) }] : [];
    });
    this.axes.show(placed.map(({ T }) => T));
    this.stage.labels.remove("place ");
    gather(placed, NEAR * this.stage.reach).forEach(({ at, texts }, k) => this.stage.labels.set(`place ${k}`, "place", texts.join("\n"), at));
    this.stage.change();
  }

  /** Returns the pose in the world; null for joints of another robot, and for undefined locations. */
  private pose(row: Message, { base, tool }: Message): Transform | null {
    if (row.pose) return transformOf(row.pose);
    if (row.joints?.length !== this.model.joints.length) return null;
    const T_robot_tool = toolFrame(this.model, row.joints, tool && transformOf(tool));
    return base ? multiply(inverse(transformOf(base)), T_robot_tool) : T_robot_tool;
  }
}

/** An explanation as a picture, in the world [m]. */
export interface Sketch {
  text: string;
  at: Point;
  /** Lines that the arm can follow (`followed`) and cannot follow (`refused`). */
  followed?: [Point, Point][];
  refused?: [Point, Point][];
  balls?: [name: string, at: Point, kind: "good" | "bad" | "stop"][];
  frames?: number[][];
}

/** The picture of WHY and EXPLAIN at the robot, until the timeline changes. */
export class ReasonView {
  readonly root = new THREE.Group();
  private readonly followed = new Lines(WIDTH);
  private readonly refused: Lines;
  private readonly axes: AxesCloud;
  private readonly balls = new THREE.Group();
  private sketch: Sketch | null = null;
  private drawn: Sketch | null = null;
  private version = -1;

  constructor(private readonly stage: Stage) {
    this.axes = new AxesCloud(LONG * stage.reach);
    this.refused = new Lines(WIDTH, DASH * stage.reach);
    this.root.add(this.followed.mesh, this.refused.mesh, this.axes.root, this.balls);
    stage.onPaint.add(() => this.draw());
  }

  explain(sketch: Sketch | null): void {
    this.sketch = sketch;
    this.stage.change();
  }

  show({ timeline }: InWorld): void {
    if (this.sketch !== this.drawn) this.version = timeline.version;
    else if (!this.drawn || timeline.version === this.version) return;
    else this.sketch = null;
    this.drawn = this.sketch;
    this.draw();
  }

  private draw(): void {
    const { colours, reach } = this.stage;
    const { text, at, followed = [], refused = [], balls = [], frames = [] } = this.drawn ?? { text: "", at: [0, 0, 0] as Point };
    const piece = (colour: string) => ([a, b]: [Point, Point]): Piece =>
      ({ a, b, from: 0, to: Math.hypot(...b.map((x, i) => x - a[i])), colour: new THREE.Color(colour) });
    this.followed.set(followed.map(piece(colours.good)));
    this.refused.set(refused.map(piece(colours.bad)));
    this.balls.clear();
    for (const [, place, kind] of balls) {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(BALL * reach, 16, 12), new THREE.MeshLambertMaterial({ color: colours[kind] }));
      ball.position.set(...place);
      this.balls.add(ball);
    }
    this.axes.show(frames);
    if (text) this.stage.labels.set("why", "why", text.length > MAX_CHARS ? `${text.slice(0, MAX_CHARS)} ...` : text, at);
    else this.stage.labels.remove("why");
    this.stage.change();
  }
}
