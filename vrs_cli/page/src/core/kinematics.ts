import { jointsOnLine } from "./inverse";
import { type Timeline, value } from "./timeline";
import { type Transform, identity, multiply, transformOf } from "./transform";

export interface Joint {
  a: number;
  d: number;
  alpha: number;
  theta?: number;
  kind?: string;
  lower: number;
  upper: number;
  velocity?: number;
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

/** Returns the transformation of a standard Denavit-Hartenberg link with its joint at x. */
export function link(joint: Joint, x: number): Transform {
  const theta = (joint.theta ?? 0) + (slides(joint) ? 0 : x);
  const d = joint.d + (slides(joint) ? x : 0);
  const [c, s, ca, sa] = [Math.cos(theta), Math.sin(theta), Math.cos(joint.alpha), Math.sin(joint.alpha)];
  return Float64Array.of(c, -s * ca, s * sa, joint.a * c, s, c * ca, -c * sa, joint.a * s, 0, sa, ca, d);
}

/** Returns T_base_link of the base and all links; the last one is the flange. */
export function frames(model: Model, q: number[]): Transform[] {
  const all = [model.base ? transformOf(model.base) : identity()];
  for (let i = 0; i < q.length; i++) all.push(multiply(all[i], link(model.joints[i], q[i])));
  if (model.flange) all[q.length] = multiply(all[q.length], transformOf(model.flange));
  return all;
}

/** g: the joints at t [rad, m]. */
export function g(model: Model, timeline: Timeline, t: number): number[] {
  const [segment, s] = timeline.locate(t);
  if (segment.joints) return segment.joints.map((polynomial) => value(polynomial, s));
  return jointsOnLine(model, segment.line!, s, timeline.tool(t)).q;
}
