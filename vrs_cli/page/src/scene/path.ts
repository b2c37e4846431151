import * as THREE from "three";
import { Change } from "../core/change";
import { toolFrame, type Model } from "../core/kinematics";
import { type Segment, type Timeline, baseOf, toolOf, value } from "../core/timeline";
import { movePoint, originOf, type Point } from "../core/transform";
import type { InWorld } from "./scene";
import { Dots, Lines, type Piece } from "./lines";
import type { Stage } from "./stage";

const AROUND = 60; // [s] of the path on either side of the displayed time
const STEP = 20; // [s] after which this window moves
const WIDTH = 3; // [px] width of lines
const WIDE = 8; // [px] width of unconfirmed and wrongly displayed parts, behind the lines
const [DOT, MARK] = [5, 9]; // [px] dots between two segments, and at the start of a command
const MAX_TEXTS = 40; // maximum number of labels of commands
const COST = 10; // the path is not redrawn for this multiple of its drawing time
const RECENT = 60; // [s] for which a wrongly displayed part stays visible

/** Returns the texts at each place; places closer than `near` [m] are joined. */
export function gather(named: { at: Point; text: string }[], near: number): { at: Point; texts: string[] }[] {
  const found: { at: Point; texts: string[] }[] = [];
  for (const { at, text } of named) {
    const here = found.find((one) => one.at.every((x, i) => Math.abs(x - at[i]) < near));
    if (here) here.texts.push(text);
    else found.push({ at, texts: [text] });
  }
  return found;
}

/** The path of the tool, past and planned, and the start of each command. */
export class PathView {
  readonly root = new THREE.Group();
  commands = false;
  private readonly way: Way;
  private readonly past = new Lines(WIDTH);
  private readonly planned = new Lines(WIDTH);
  private readonly wide = new Lines(WIDE);
  private readonly dots = new Dots(DOT);
  private readonly marks = new Dots(MARK);
  private drawn: unknown[] = [];
  private readonly sides = new Change();
  private drawings = 0;
  private near: WayLine[] = [];
  private wait = 0; // [ms] time of the next possible drawing
  private timer = 0;

  constructor(private readonly stage: Stage, model: Model) {
    this.way = new Way(model);
    this.wide.mesh.renderOrder = -1;
    this.wide.mesh.material.depthWrite = false;
    this.root.add(this.wide.mesh, this.past.mesh, this.planned.mesh, this.dots.points, this.marks.points);
    stage.onPaint.add(() => this.redraw());
  }

  set visible(on: boolean) {
    this.root.visible = on;
    this.redraw();
  }

  /** Forces a new drawing of the path. */
  redraw(): void {
    this.drawn = [];
  }

  show(shown: InWorld): void {
    if (!this.root.visible) {
      if (this.drawn.length) this.stage.labels.remove("command ");
      this.drawn = [];
      return;
    }
    const { t, timeline } = shown;
    const wanted = [timeline, timeline.version, timeline.number, timeline.segments.length, Math.floor(t / STEP), this.commands];
    if (wanted.some((x, i) => x !== this.drawn[i])) {
      const begin = performance.now();
      if (begin < this.wait && this.drawn.length) {
        window.clearTimeout(this.timer);
        this.timer = window.setTimeout(() => this.stage.change(), this.wait - begin + 1);
      } else {
        this.draw(shown);
        this.drawn = wanted;
        this.drawings++;
        this.wait = performance.now() + COST * (performance.now() - begin);
      }
    }
    this.past.split(t, true);
    this.planned.split(t, false);
    this.showSides(shown);
  }

  private draw({ t, timeline }: InWorld): void {
    const at = Math.floor(t / STEP) * STEP;
    const { colours, reach } = this.stage;
    this.near = this.way.lines(timeline, at - AROUND, at + STEP + AROUND, t);
    this.past.set(this.near.flatMap((line) => piecesOf(line, line.blends ? colours.pastBlend : colours.past)));
    this.planned.set(this.near.flatMap((line) => piecesOf(line, line.blends ? colours.plannedBlend : colours.planned)));
    const starts = this.near.filter((line) => line.starts);
    this.dots.set(this.near.filter((line) => !line.steers).map((line) => line.points[line.points.length - 1]), colours.dot);
    this.marks.set(starts.map((line) => line.points[0]), colours.mark);
    this.stage.labels.remove("command ");
    if (!this.commands) return;
    const shown = starts.sort((a, b) => Math.abs(a.begin - t) - Math.abs(b.begin - t)).slice(0, MAX_TEXTS).sort((a, b) => a.begin - b.begin);
    const written = shown.map((line) => ({ at: line.points[0], text: line.segment.motion.text ?? "" })).filter(({ text }) => text);
    gather(written, 0.02 * reach).forEach(({ at, texts }, k) => this.stage.labels.set(`command ${k}`, "command", texts.join("\n"), at));
  }

  /** Draws unconfirmed and recently wrong parts of the path of a robot behind a line with delays. */
  private showSides({ t, now, source }: InWorld): void {
    const { preview } = source;
    const since = preview ? preview.unconfirmed(now) : Infinity;
    const flagged = (preview?.flagged ?? []).filter(([begin, end]) => t - RECENT < end && begin < t + RECENT);
    if (!this.sides.to([this.drawings, Math.round(20 * since), flagged])) return;
    const { unconfirmed, flagged: wrong } = this.stage.colours;
    this.wide.set([...this.cut(since, Infinity, unconfirmed), ...flagged.flatMap(([begin, end]) => this.cut(begin, end, wrong))]);
  }

  /** Returns the pieces of the path between two times. */
  private cut(begin: number, end: number, colour: string): Piece[] {
    return this.near.flatMap((line) => piecesOf(line, colour)).flatMap((piece) => {
      const { a, b, from, to } = piece;
      const [first, last] = [Math.max(begin, from), Math.min(end, to)];
      const at = (t: number): Point => a.map((x, k) => x + ((t - from) / (to - from)) * (b[k] - x)) as Point;
      return first < last ? [{ ...piece, a: at(first), b: at(last), from: first, to: last }] : [];
    });
  }
}

/** Returns the pieces of a line in a colour. */
function piecesOf({ begin, times, points }: WayLine, paint: string): Piece[] {
  const colour = new THREE.Color(paint);
  return points.slice(1).map((b, i) => ({ a: points[i], b, from: begin + times[i], to: begin + times[i + 1], colour }));
}

/** The path of the tool tip in one segment: points in the world [m], with their times in the segment [s]. */
interface Sampled {
  duration: number;
  frames: unknown;
  times: number[];
  points: Point[];
}

/** The same with its start time; `starts`: whether a command starts there. */
interface WayLine {
  segment: Segment;
  begin: number;
  end: number;
  times: number[];
  points: Point[];
  blends: boolean;
  steers: boolean;
  starts: boolean;
}

export const ERROR = 0.0005; // [m] maximum distance between the path and its lines
const MARGIN = 0.8; // of the error: reserve for distances between the probes
const LATE = 0.004; // [m] maximum distance between the tip and the point of the line at the same time
const TURN = 0.5; // [rad, m] of all joints together: on a path this short the tip turns back at most once
const LOOKS = 16; // parts of a segment for measuring the path of its joints
const PROBES = [0.25, 0.5, 0.75]; // of a line: places to measure the distance from the path
const DEEPEST = 12; // maximum number of halvings
const MAX_PIECES = 6000; // maximum number of lines; more are cut to those around the displayed time

/** Returns a function from the time in a segment to the position of the tool tip in the world. */
function tipOf(model: Model, { motion, joints, line }: Segment): (s: number) => Point {
  const [T_world_robot, tool] = [baseOf(motion), toolOf(motion)];
  const at = (polynomials: number[][], s: number): number[] => polynomials.map((polynomial) => value(polynomial, s));
  return (s) => movePoint(T_world_robot, line ? at(line.position, s) : originOf(toolFrame(model, at(joints!, s), tool)));
}

/** Returns the distance of p from the straight line between a and b. */
export function distanceFromLine(p: Point, a: Point, b: Point): number {
  const [along, there] = [b.map((x, i) => x - a[i]), p.map((x, i) => x - a[i])];
  const square = along.reduce((sum, x) => sum + x * x, 0);
  const part = square > 0 ? Math.min(Math.max(along.reduce((sum, x, i) => sum + x * there[i], 0) / square, 0), 1) : 0;
  return Math.hypot(...there.map((x, i) => x - part * along[i]));
}

/** Samples the path of the tip in a segment: few points, by curvature and by the evenness of time on each piece. */
function sample(model: Model, segment: Segment): Sampled {
  const tip = tipOf(model, segment);
  const duration = segment.finish - segment.start;
  let way = 0; // path of all joints together
  for (const polynomial of segment.joints ?? [])
    for (let k = 0; k < LOOKS; k++)
      way += Math.abs(value(polynomial, (duration * (k + 1)) / LOOKS) - value(polynomial, (duration * k) / LOOKS));
  const pieces = Math.max(Math.ceil(way / TURN), 1);
  const times = [0], points = [tip(0)];
  const refine = (t0: number, p0: Point, t1: number, p1: Point, depth: number): void => {
    const probes = PROBES.map((part) => tip(t0 + part * (t1 - t0)));
    const near = probes.every((p, i) => {
      const late = Math.hypot(...p.map((x, k) => x - p0[k] - PROBES[i] * (p1[k] - p0[k])));
      return late <= LATE && (late <= MARGIN * ERROR || distanceFromLine(p, p0, p1) <= MARGIN * ERROR);
    });
    if (depth === 0 || near) {
      times.push(t1);
      points.push(p1);
      return;
    }
    const middle = 0.5 * (t0 + t1);
    refine(t0, p0, middle, probes[1], depth - 1);
    refine(middle, probes[1], t1, p1, depth - 1);
  };
  let [last, at] = [0, points[0]];
  for (let k = 1; k <= pieces; k++) {
    const t = (duration * k) / pieces;
    const p = tip(t);
    refine(last, at, t, p, DEEPEST);
    [last, at] = [t, p];
  }
  return { duration, frames: segment.motion.frames, times, points };
}

/** Computes the path of one robot's tool. Segments that an edit does not change are not recomputed. */
export class Way {
  private readonly known = new WeakMap<object, Sampled>();
  /** Number of sampled segments, for tests. */
  computed = 0;

  constructor(private readonly model: Model) {}

  private sampled(segment: Segment): Sampled {
    const path = (segment.joints ?? segment.line)!; // stays the same object if the segment is only shifted in time
    const known = this.known.get(path);
    if (known && known.duration === segment.finish - segment.start && known.frames === segment.motion.frames) return known;
    const made = sample(this.model, segment);
    this.computed++;
    this.known.set(path, made);
    return made;
  }

  /** Returns the lines between two times [s], in order; if too many, those nearest to `t`. */
  lines(timeline: Timeline, begin: number, end: number, t: number): WayLine[] {
    const found: WayLine[] = [];
    let before: Segment | null = null;
    for (const segment of timeline.segments) {
      if (segment.start >= end) break;
      if (segment.phase === "rest" || segment.finish <= segment.start) continue;
      const steers = segment.motion.kind === "steered";
      const other: Segment | null = before;
      before = segment;
      if (segment.finish <= begin) continue;
      const starts = !other || (other.motion.number !== segment.motion.number && !(steers && other.motion.kind === "steered"));
      const { times, points } = this.sampled(segment);
      const blends = segment.phase === "blend" && !steers;
      found.push({ segment, begin: segment.start, end: segment.finish, times, points, blends, steers, starts });
    }
    let count = found.reduce((sum, line) => sum + line.points.length - 1, 0);
    while (count > MAX_PIECES) {
      const [first, last] = [found[0], found[found.length - 1]];
      const gone = t - first.end > last.begin - t ? found.shift()! : found.pop()!;
      count -= gone.points.length - 1;
    }
    return found;
  }
}
