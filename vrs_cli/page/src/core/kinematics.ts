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

/** The numbers of an arm that do not depend on its joints: computed once for each model. */
interface Chain {
  base: Transform;
  flange: Transform | null;
  /** a, d, theta, cos(alpha), sin(alpha) of each link, and 1 where its joint slides. */
  links: Float64Array;
}
const STRIDE = 6;
const chains = new WeakMap<Model, Chain>();

function chainOf(model: Model): Chain {
  let chain = chains.get(model);
  if (!chain) {
    const rows = model.joints.flatMap((j) => [j.a, j.d, j.theta ?? 0, Math.cos(j.alpha), Math.sin(j.alpha), slides(j) ? 1 : 0]);
    const [base, flange] = [model.base ? transformOf(model.base) : identity(), model.flange ? transformOf(model.flange) : null];
    chains.set(model, (chain = { base, flange, links: Float64Array.from(rows) }));
  }
  return chain;
}

/** Returns T_base_link of the base and all links; the last one is the flange. */
export function frames(model: Model, q: ArrayLike<number>): Transform[] {
  const { base, flange, links } = chainOf(model);
  const all: Transform[] = [base.slice()];
  let A: Transform = base;
  for (let i = 0; i < q.length; i++) all.push((A = after(A, links, STRIDE * i, q[i])));
  if (flange) all[q.length] = multiply(A, flange);
  return all;
}

/** Returns A times the link whose numbers begin at k, with its joint at x. */
function after(A: Transform, links: Float64Array, k: number, x: number): Transform {
  const [a, ca, sa] = [links[k], links[k + 3], links[k + 4]];
  const theta = links[k + 5] ? links[k + 2] : links[k + 2] + x;
  const d = links[k + 5] ? links[k + 1] + x : links[k + 1];
  const c = Math.cos(theta);
  const s = Math.sin(theta);
  const B = new Float64Array(12);
  for (let r = 0; r < 12; r += 4) {
    const n = A[r] * c + A[r + 1] * s;
    const o = A[r + 1] * c - A[r] * s;
    const z = A[r + 2];
    B[r] = n;
    B[r + 1] = o * ca + z * sa;
    B[r + 2] = z * ca - o * sa;
    B[r + 3] = A[r + 3] + d * z + a * n;
  }
  return B;
}

/** g: the joints at t [rad, m]. */
export function g(model: Model, timeline: Timeline, t: number): number[] {
  const [segment, s] = timeline.locate(t);
  if (segment.joints) return segment.joints.map((polynomial) => value(polynomial, s));
  return jointsOnLine(model, segment.line!, s, timeline.tool(t)).q;
}
