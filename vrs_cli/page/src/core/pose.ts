import { type Model, frames, g } from "./kinematics";
import type { Segment, Timeline } from "./timeline";
import { type Transform, inverse, multiply, transformOf } from "./transform";

const POLE = 1e-10; // [rad]: a tool axis this near to the vertical is vertical
const STEP = 1e-4; // [s] or share of a second, over which speeds are measured

/** Returns x with so many digits, never as -0. */
export function fixed(x: number, digits: number): string {
  const text = x.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text;
}

const halfOpen = (angle: number): number => (angle === -Math.PI ? Math.PI : angle + 0);

/** Returns O, A, T of VAL-II [rad]: O and T in (-pi, pi], A in [-pi/2, pi/2]; O = pi/2 where the tool is vertical. */
export function oat(T: Transform): [number, number, number] {
  const [nx, sx, ax, , ny, sy, ay, , , , az] = T;
  const h = Math.hypot(ax, ay);
  if (h < POLE) return [Math.PI / 2, az > 0 ? -Math.PI / 2 : Math.PI / 2, halfOpen(Math.atan2(ny, sy))];
  const o = halfOpen(Math.atan2(ay, ax)) + Math.PI / 2;
  const t = halfOpen(Math.atan2(ax * ny - ay * nx, ax * sy - ay * sx));
  return [o > Math.PI ? o - 2 * Math.PI : o, Math.atan2(h, az) - Math.PI / 2, t];
}

/** Returns T_world_tool at t of T_robot_tool: in the world that BASE has set. */
export function inWorld(timeline: Timeline, t: number, T_robot_tool: Transform): Transform {
  const base = timeline.locate(t)[0].motion.frames?.base;
  return base ? multiply(inverse(transformOf(base)), T_robot_tool) : T_robot_tool;
}

/** Speeds at a time: of the joints [rad/s, m/s], and of the tool [m/s]. */
export interface Speeds {
  joints: number[];
  tool: number;
}

/** Returns the speeds at t; 0 in gaps and after the end. */
export function speedsAt(model: Model, timeline: Timeline, t: number): Speeds {
  const [segment, s] = timeline.locate(t);
  if (t < segment.start || t > segment.finish || rests(segment)) return { joints: model.joints.map(() => 0), tool: 0 };
  const joints = segment.joints ? segment.joints.map((a) => slope(a, s)) : lineSpeeds(model, timeline, segment, t);
  const q = g(model, timeline, t);
  const [before, after] = [-STEP, STEP].map((by) => tip(model, timeline, t, q.map((x, i) => x + by * joints[i])));
  return { joints, tool: Math.hypot(...[3, 7, 11].map((i) => after[i] - before[i])) / (2 * STEP) };
}

/** Whether the robot stands throughout a segment. */
export const rests = (segment: Segment): boolean => segment.phase === "rest";

function slope(a: number[], s: number): number {
  let sum = 0;
  for (let i = a.length - 1; i > 0; i--) sum = sum * s + i * a[i];
  return sum;
}
function lineSpeeds(model: Model, timeline: Timeline, segment: Segment, t: number): number[] {
  const from = Math.max(t - STEP, segment.start);
  const to = Math.min(t + STEP, segment.finish - 1e-9);
  if (to <= from) return model.joints.map(() => 0);
  const [a, b] = [g(model, timeline, from), g(model, timeline, to)];
  return a.map((x, i) => (b[i] - x) / (to - from));
}
function tip(model: Model, timeline: Timeline, t: number, q: number[]): Transform {
  const all = frames(model, q);
  const tool = timeline.tool(t);
  return tool ? multiply(all[all.length - 1], tool) : all[all.length - 1];
}

/** How a joint is shown: its name, its unit and what a value of the wire is multiplied by. */
export const jointUnits = (model: Model): { name: string; unit: string; scale: number; lower: number; upper: number; limit: number }[] =>
  model.joints.map((joint, i) => {
    const slides = joint.kind === "prismatic";
    return {
      name: `JT${i + 1}`, unit: slides ? "mm" : "°", scale: slides ? 1000 : 180 / Math.PI,
      lower: joint.lower, upper: joint.upper, limit: (joint as { max_velocity?: number }).max_velocity ?? joint.velocity ?? Infinity,
    };
  });

