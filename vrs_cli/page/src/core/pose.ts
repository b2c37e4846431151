import { type Model, g, toolFrame } from "./kinematics";
import type { Timeline } from "./timeline";
import { type Transform, originOf } from "./transform";

const POLE = 1e-10; // [rad] a tool axis this close to the vertical counts as vertical
const STEP = 1e-4; // [s] distance of the samples on either side for speeds

/** Returns x with `digits` decimals, never -0. */
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

/** Speeds at a time: of the joints [rad/s, m/s], and of the tool [m/s]. */
export interface Speeds {
  joints: number[];
  tool: number;
}

/** Returns the speeds at t; 0 in gaps and after the end. */
export function speedsAt(model: Model, timeline: Timeline, t: number): Speeds {
  const [segment, s] = timeline.locate(t);
  const from = Math.max(t - STEP, segment.start);
  const to = Math.min(t + STEP, segment.finish - 1e-9);
  if (!timeline.moves(t) || to <= from) return { joints: model.joints.map(() => 0), tool: 0 };
  const [before, after] = [from, to].map((at) => g(model, timeline, at));
  const joints = segment.joints?.map((a) => slope(a, s)) ?? after.map((x, i) => (x - before[i]) / (to - from));
  const tool = timeline.tool(t);
  const [a, b] = [before, after].map((q) => originOf(toolFrame(model, q, tool)));
  return { joints, tool: Math.hypot(...b.map((x, i) => x - a[i])) / (to - from) };
}

/** Returns the derivative of a polynomial at s. */
function slope(a: number[], s: number): number {
  let sum = 0;
  for (let i = a.length - 1; i > 0; i--) sum = sum * s + i * a[i];
  return sum;
}
