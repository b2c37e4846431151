import { toolFrame, type Model } from "../core/kinematics";
import { type Segment, type Timeline, baseOf, toolOf, value } from "../core/timeline";
import { movePoint, originOf, type Point } from "../core/transform";

/** The way of the tool tip in one segment: points in the world [m], with the times in the segment [s]. */
interface Sampled {
  duration: number;
  frames: unknown;
  times: number[];
  points: Point[];
}

/** The same at its time; `starts`: a command takes over where it begins. */
export interface WayLine {
  segment: Segment;
  begin: number;
  end: number;
  times: number[];
  points: Point[];
  blends: boolean;
  steers: boolean;
  starts: boolean;
}

export const ERROR = 0.0005; // [m] between the way and its lines, at most
const MARGIN = 0.8; // of the error: between the probes the way is a little farther from its line
const LATE = 0.004; // [m] between the tip and the place on its line that belongs to the time
const TURN = 0.5; // [rad, m] of all joints together: on so short a way the tip turns to and fro once at most
const LOOKS = 16; // parts of a segment by which the way of its joints is measured
const PROBES = [0.25, 0.5, 0.75]; // of a line: where its distance from the way is looked at
const DEEPEST = 12; // halvings
const MAX_PIECES = 6000; // of a way with more, the lines around the present are returned

/** Returns a function from the time in a segment to the place of the tool tip in the world. */
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

/** Samples the way of the tip in a segment: few points, by curvature and by how evenly time passes on each piece. */
function sample(model: Model, segment: Segment): Sampled {
  const tip = tipOf(model, segment);
  const duration = segment.finish - segment.start;
  let way = 0; // of all joints together
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

/** Computes the way of the tool of one robot. What an edit leaves as it is, is not computed again. */
export class Way {
  private readonly known = new WeakMap<object, Sampled>();
  /** Segments sampled so far: for tests. */
  computed = 0;

  constructor(private readonly model: Model) {}

  private sampled(segment: Segment): Sampled {
    const path = (segment.joints ?? segment.line)!; // stays the same object where the segment is moved in time
    const known = this.known.get(path);
    if (known && known.duration === segment.finish - segment.start && known.frames === segment.motion.frames) return known;
    const made = sample(this.model, segment);
    this.computed++;
    this.known.set(path, made);
    return made;
  }

  /** Returns the lines between two times [s], in order; of too many those nearest to `t`. */
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
