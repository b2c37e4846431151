import { jointsOnLine } from "./inverse";
import { type Timeline, value } from "./timeline";
import { type Transform, identity, multiply, transformOf } from "./transform";

/** A joint and its link, by the parameters of Denavit and Hartenberg in the standard convention. */
export interface Joint {
  a: number;
  d: number;
  alpha: number;
  theta?: number;
  kind?: string;
  lower: number;
  upper: number;
  velocity?: number;
  max_velocity?: number;
}
/** What `welcome` says of the robot: metres and radians. */
export interface Model {
  name: string;
  title: string;
  joints: Joint[];
  base?: number[];
  flange?: number[];
  /** Which part of a pose counts; all of it where it is absent. */
  task?: string;
  shapes?: Shape[];
  poses: Record<string, number[]>;
}
export interface Shape {
  link: number;
  kind: string;
  colour?: string;
  size?: number[];
  at?: number[];
  from?: number[];
  to?: number[];
  radius?: number | number[];
  across?: number[];
  thickness?: number | number[];
  opens?: number[];
  glb?: string;
}

export const slides = (joint: Joint): boolean => joint.kind === "prismatic";

/** Returns A times the transformation of a link with its joint at x. */
export function linkAfter(A: Transform, joint: Joint, x: number): Transform {
  const theta = (joint.theta ?? 0) + (slides(joint) ? 0 : x);
  const d = joint.d + (slides(joint) ? x : 0);
  const c = Math.cos(theta), s = Math.sin(theta), ca = Math.cos(joint.alpha), sa = Math.sin(joint.alpha);
  const B = new Float64Array(12);
  for (let r = 0; r < 12; r += 4) {
    const n = A[r] * c + A[r + 1] * s;
    const o = A[r + 1] * c - A[r] * s;
    B[r] = n;
    B[r + 1] = o * ca + A[r + 2] * sa;
    B[r + 2] = A[r + 2] * ca - o * sa;
    B[r + 3] = A[r + 3] + d * A[r + 2] + joint.a * n;
  }
  return B;
}

/** Returns T_base_link of the base and all links; the last one is the flange. */
export function frames({ joints, base, flange }: Model, q: ArrayLike<number>): Transform[] {
  const all = [base ? transformOf(base) : identity()];
  for (let i = 0; i < q.length; i++) all.push(linkAfter(all[i], joints[i], q[i]));
  if (flange) all[q.length] = multiply(all[q.length], transformOf(flange));
  return all;
}

/** Returns T_robot_tool with the joints at q. `tool`: T_flange_tool, absent for the flange itself. */
export function toolFrame(model: Model, q: ArrayLike<number>, tool?: Transform): Transform {
  const flange = frames(model, q)[q.length];
  return tool ? multiply(flange, tool) : flange;
}

/** g: the joints at t [rad, m]. */
export function g(model: Model, timeline: Timeline, t: number): number[] {
  const [segment, s] = timeline.locate(t);
  if (segment.joints) return segment.joints.map((polynomial) => value(polynomial, s));
  return jointsOnLine(model, segment.line!, s, timeline.tool(t)).q;
}

/** How joints are shown: their names, units, and what a value of the wire is multiplied by. */
export const jointUnits = ({ joints }: Model): { name: string; unit: string; scale: number; lower: number; upper: number; limit: number }[] =>
  joints.map((joint, i) => ({
    name: `JT${i + 1}`, unit: slides(joint) ? "mm" : "°", scale: slides(joint) ? 1000 : DEGREES,
    lower: joint.lower, upper: joint.upper, limit: joint.max_velocity ?? joint.velocity ?? Infinity,
  }));

export const DEGREES = 180 / Math.PI; // in a radian
