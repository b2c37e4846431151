import { Transform, identity, multiply, rotation, transformOf } from "./transform";
import { Line, Timeline, value } from "./timeline";

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

const slides = (joint: Joint): boolean => joint.kind === "prismatic";

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
  q.forEach((x, i) => all.push(multiply(all[i], link(model.joints[i], x))));
  if (model.flange) all[q.length] = multiply(all[q.length], transformOf(model.flange));
  return all;
}

/** Returns T_robot_tool of a line at s. */
export function linePose(line: Line, s: number): Transform {
  let T = transformOf(line.orientation);
  T[3] = T[7] = T[11] = 0;
  for (const turn of line.turns) T = multiply(T, rotation(turn.axis, value(turn.angle, s)));
  for (let i = 0; i < 3; i++) T[3 + 4 * i] = value(line.position[i], s);
  return T;
}

/** Joints on a line at s: Gauss-Newton from the seeds, interpolated. `tool`: T_flange_tool. */
export function onLine(m: Model, l: Line, s: number, tool?: Transform): { q: number[]; steps: number; error: number } {
  const n = m.joints.length, x = s / l.seed_interval, k = Math.min(Math.max(Math.floor(x), 0), l.seeds.length - 1), f = x - k;
  const a = l.seeds[k], b = l.seeds[Math.min(k + 1, l.seeds.length - 1)];
  const q = a.map((v, i) => v + (b[i] - v) * Math.min(f, 1)), W = linePose(l, s), guides = l.guides ?? [], rows = 6 + guides.length;
  let steps = 0, error = Infinity;
  for (; steps < 12; steps++) {
    const F = frames(m, q), E = tool ? multiply(F[n], tool) : F[n], e = new Float64Array(rows);
    for (let i = 0; i < 3; i++) e[i] = W[3 + 4 * i] - E[3 + 4 * i];
    for (let c = 0; c < 3; c++) {
      e[3] += 0.5 * (E[4 + c] * W[8 + c] - E[8 + c] * W[4 + c]);
      e[4] += 0.5 * (E[8 + c] * W[c] - E[c] * W[8 + c]);
      e[5] += 0.5 * (E[c] * W[4 + c] - E[4 + c] * W[c]);
    }
    guides.forEach((g, i) => { e[6 + i] = value(g.value, s) - g.weights.reduce((sum, w, j) => sum + w * q[j], 0); });
    error = 0; for (const v of e) error = Math.max(error, Math.abs(v));
    if (error < 1e-13) break;
    const J = new Float64Array(rows * n);
    for (let j = 0; j < n; j++) {
      const A = F[j], zx = A[2], zy = A[6], zz = A[10];
      if (m.joints[j].kind === "prismatic") { J[j] = zx; J[n + j] = zy; J[2 * n + j] = zz; }
      else {
        const px = E[3] - A[3], py = E[7] - A[7], pz = E[11] - A[11];
        J[j] = zy * pz - zz * py; J[n + j] = zz * px - zx * pz; J[2 * n + j] = zx * py - zy * px;
        J[3 * n + j] = zx; J[4 * n + j] = zy; J[5 * n + j] = zz;
      }
      guides.forEach((g, i) => { J[(6 + i) * n + j] = g.weights[j]; });
    }
    const dq = least(J, e, rows, n);
    for (let j = 0; j < n; j++) q[j] += dq[j];
    let change = 0; for (const v of dq) change = Math.max(change, Math.abs(v));
    if (change < 1e-15) break;
  }
  return { q, steps, error };
}
function least(J: Float64Array, e: Float64Array, rows: number, n: number): Float64Array {
  const A = new Float64Array(n * n), b = new Float64Array(n);
  for (let i = 0; i < n; i++) {
    for (let j = 0; j <= i; j++) { let s = i === j ? 1e-12 : 0; for (let r = 0; r < rows; r++) s += J[r * n + i] * J[r * n + j]; A[i * n + j] = s; }
    for (let r = 0; r < rows; r++) b[i] += J[r * n + i] * e[r];
  }
  for (let i = 0; i < n; i++) for (let j = 0; j <= i; j++) {
    let s = A[i * n + j]; for (let k = 0; k < j; k++) s -= A[i * n + k] * A[j * n + k];
    A[i * n + j] = i === j ? Math.sqrt(Math.max(s, 1e-300)) : s / A[j * n + j];
  }
  for (let i = 0; i < n; i++) { for (let k = 0; k < i; k++) b[i] -= A[i * n + k] * b[k]; b[i] /= A[i * n + i]; }
  for (let i = n - 1; i >= 0; i--) { for (let k = i + 1; k < n; k++) b[i] -= A[k * n + i] * b[k]; b[i] /= A[i * n + i]; }
  return b;
}

/** g: the joints at t. */
export function g(model: Model, timeline: Timeline, t: number): number[] {
  const [segment, s] = timeline.locate(t);
  if (segment.joints) return segment.joints.map((polynomial) => value(polynomial, s));
  return onLine(model, segment.line!, s, timeline.tool(t)).q;
}
