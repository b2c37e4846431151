import { type Line, type Timeline, value } from "./timeline";
import { type Point as Vector, type Transform, column, identity, inverse, movePoint, multiply, originOf, rotation, transformOf } from "./transform";

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
/** The robot's model from `welcome`, in metres and radians. */
export interface Model {
  name: string;
  title: string;
  joints: Joint[];
  base?: number[];
  flange?: number[];
  /** The part of a pose that counts; absent: all of it. */
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

/** Names and units of joints, and the factor from values of the wire to displayed ones. */
export const jointUnits = ({ joints }: Model): { name: string; unit: string; scale: number; lower: number; upper: number; limit: number }[] =>
  joints.map((joint, i) => ({
    name: `JT${i + 1}`, unit: slides(joint) ? "mm" : "°", scale: slides(joint) ? 1000 : DEGREES,
    lower: joint.lower, upper: joint.upper, limit: joint.max_velocity ?? joint.velocity ?? Infinity,
  }));

export const DEGREES = 180 / Math.PI; // in a radian

// --- joints on a line -------------------------------------------------------------------------------------------------

const STEPS = 20; // maximum steps of Newton's method; from a seed it takes 2 to 4
const EXACT = 1e-14; // [m, rad] error and step that count as zero
const SINGULAR = 1e-9; // of the largest entry: a smaller pivot counts as zero
const DAMPING = 1e-14; // damping at singular joints
const LARGEST_STEP = 0.5; // [rad, m]

/** Which of X, Y, Z of the robot's frame and of the turns about X, Y, Z of the flange count for a task; all where it is not
 * here. What no joint of an arm changes may count: its rows of the Jacobian are 0. */
const COUNTS: Record<string, string> = { pointing: "111110", upright: "111001", position: "111000", point: "111000" };

/** Returns T_robot_tool of a line at s. */
export function linePose(line: Line, s: number): Transform {
  let T = transformOf(line.orientation);
  T[3] = T[7] = T[11] = 0;
  for (const turn of line.turns) T = multiply(T, rotation(turn.axis, value(turn.angle, s)));
  for (let i = 0; i < 3; i++) T[3 + 4 * i] = value(line.position[i], s);
  return T;
}

/** The joints on a line at s [rad, m], the number of steps, and the remaining error [m, rad]. */
export interface Found {
  q: number[];
  steps: number;
  missing: number;
}

/** Finds the joints on a line at s by Newton's method from its seeds. `tool`: T_flange_tool. */
export function jointsOnLine(model: Model, line: Line, s: number, tool?: Transform): Found {
  const want = linePose(line, s);
  const q = startOn(line, s);
  const flange = tool ? multiply(want, inverse(tool)) : want;
  if (model.task === "steady") return steadyJoints(model, want, flange, tool ? originOf(tool) : [0, 0, 0], q);
  const counts = COUNTS[model.task ?? ""] ?? "111111";
  let [missing, steps] = [Infinity, 0];
  for (; steps < STEPS; steps++) {
    const rows = equations(model, frames(model, q), flange, counts);
    for (const guide of line.guides ?? []) rows.push([...guide.weights, value(guide.value, s) - dotted(guide.weights, q)]);
    missing = largest(rows.map((row) => row[q.length]));
    if (missing < EXACT || !goOn(q, solve(rows))) break;
  }
  return { q, steps, missing };
}

/** Interpolates the two seeds around s, or returns the nearer one if they differ much. */
function startOn({ seeds, seed_interval }: Line, s: number): number[] {
  const last = seeds.length - 1;
  const x = last ? Math.min(Math.max(s / seed_interval, 0), last) : 0;
  const [a, b] = [seeds[Math.floor(x)], seeds[Math.ceil(x)]];
  if (a.some((from, i) => Math.abs(b[i] - from) > LARGEST_STEP)) return seeds[Math.round(x)].slice();
  return a.map((from, i) => from + (x - Math.floor(x)) * (b[i] - from));
}

/** Adds a step of at most `LARGEST_STEP` to q; returns false if it is too small to change anything. */
function goOn(q: number[], step: number[]): boolean {
  const most = largest(step);
  const scale = most > LARGEST_STEP ? LARGEST_STEP / most : 1;
  for (let i = 0; i < q.length; i++) q[i] += scale * step[i];
  return most > EXACT;
}

/** Returns the relevant rows of the Jacobian of the flange, each with its error [m, rad]. */
function equations(model: Model, F: Transform[], want: Transform, counts: string): number[][] {
  const have = F[F.length - 1];
  const turn = counts === COUNTS.pointing ? turnBetween(column(have, 2), column(want, 2)) : rotationVector(have, want);
  const J = jacobian(model, F, originOf(have));
  const places = [0, 1, 2].map((k) => [...J.map(({ moves }) => moves[k]), want[3 + 4 * k] - have[3 + 4 * k]]);
  const turns = [0, 1, 2].map((k) => [...J.map(({ turns }) => turns), turn].map((about) => dotted(about, column(have, k))));
  return [...places, ...turns].filter((_, k) => counts[k] === "1");
}

/** Returns the velocity and the angular velocity that each joint gives a point [m] in the robot's frame. */
function jacobian(model: Model, F: Transform[], at: Vector): { moves: Vector; turns: Vector }[] {
  return model.joints.map((joint, j) => {
    const axis = column(F[j], 2);
    if (slides(joint)) return { moves: axis, turns: [0, 0, 0] };
    return { moves: crossed(axis, [at[0] - F[j][3], at[1] - F[j][7], at[2] - F[j][11]]), turns: axis };
  });
}

/** Finds the joints of an arm of four or five joints that bring the tip of its tool (`reach` in the flange) to the place
 * exactly, turned as nearly as it can: 1 - cos of the turn that is missing has the least value among the joints that
 * reach the place.
 *
 * With the rows P and O of what each joint does to place and direction, the missing turn's axis e as long as its sine,
 * and multipliers l: P l = O e, and the place is reached (Lagrange's conditions). The system of the next joints and
 * multipliers is solved until nothing changes; vrs_cli/kinematics/numeric/steady/conditions.py has the derivation.
 */
function steadyJoints(model: Model, want: Transform, flange: Transform, reach: Vector, q: number[]): Found {
  const n = q.length;
  let multipliers: number[] | undefined;
  let [missing, steps] = [Infinity, 0];
  for (; steps < STEPS; steps++) {
    const F = frames(model, q);
    const have = F[n];
    const tip = movePoint(have, reach);
    const J = jacobian(model, F, tip);
    const away = [0, 1, 2].map((c) => want[3 + 4 * c] - tip[c]);
    const R = [0, 4, 8].map((r) => have.slice(r, r + 3));
    const M = R.map((row) => [0, 4, 8].map((r) => dotted(row, flange.subarray(r, r + 3)))); // R_have R_want^T
    const sine: Vector = [0.5 * (M[1][2] - M[2][1]), 0.5 * (M[2][0] - M[0][2]), 0.5 * (M[0][1] - M[1][0])];
    const half = M.map((row, a) => row.map((x, b) => 0.5 * (x - (a === b ? M[0][0] + M[1][1] + M[2][2] : 0))));
    const pull = J.map(({ turns }) => dotted(turns, sine));
    multipliers ??= leastSquares(J.map(({ moves }, i) => [...moves, pull[i]]));
    const rows = J.map(({ moves, turns }, i) => {
      const entries = J.map((other, k) => {
        const [first, later] = i < k ? [turns, other.moves] : [other.turns, moves];
        const turned = i > k ? dotted(crossed(other.turns, turns), sine) : 0;
        return dotted(crossed(first, later), multipliers!) - turned - dotted(turns, half.map((row) => dotted(row, other.turns)));
      });
      return [...entries, ...moves, pull[i]];
    });
    for (let c = 0; c < 3; c++) rows.push([...J.map(({ moves }) => moves[c]), 0, 0, 0, away[c]]);
    const next = solve(rows);
    multipliers = next.slice(n);
    missing = largest(away);
    if (!goOn(q, next.slice(0, n))) break;
  }
  return { q, steps, missing };
}

// --- turns and equations --------------------------------------------------------------------------------------------

const crossed = ([a, b, c]: Vector, [x, y, z]: Vector): Vector => [b * z - c * y, c * x - a * z, a * y - b * x];
const largest = (v: number[]): number => Math.max(0, ...v.map(Math.abs));
/** Returns the sum of a_i b_i over the length of a. */
function dotted(a: ArrayLike<number>, b: ArrayLike<number>): number {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i] * b[i];
  return sum;
}

/** Returns the rotation vector of R_want R_have^T [rad]. */
function rotationVector(have: Transform, want: Transform): Vector {
  const pairs = [0, 1, 2].map((c) => [column(have, c), column(want, c)]);
  const sines = pairs.map(([h, w]) => crossed(h, w));
  const trace = pairs.reduce((sum, [h, w]) => sum + dotted(h, w), 0);
  return asLongAsAngle([0, 1, 2].map((k) => 0.5 * (sines[0][k] + sines[1][k] + sines[2][k])) as Vector, 0.5 * (trace - 1));
}

/** Returns the shortest rotation vector that brings direction a to b [rad]. */
const turnBetween = (a: Vector, b: Vector): Vector => asLongAsAngle(crossed(a, b), dotted(a, b));

/** Rescales a rotation vector from the sine of its angle to the angle. */
function asLongAsAngle(v: Vector, cosine: number): Vector {
  const sine = Math.hypot(...v);
  if (sine < 1e-12) return cosine > 0 ? v : [1e-3, 0, 0]; // half a turn about any axis; the next step finds the right one
  const factor = Math.atan2(sine, cosine) / sine;
  return [v[0] * factor, v[1] * factor, v[2] * factor];
}

/** Solves rows of n coefficients and a right side; by least squares if they are singular or not n. */
function solve(rows: number[][]): number[] {
  const n = rows[0].length - 1;
  const scale = largest(rows.map((row) => largest(row.slice(0, n))));
  return (rows.length === n && eliminated(rows, SINGULAR * scale)) || leastSquares(rows);
}

/** Solves the normal equations of such rows, slightly damped. */
function leastSquares(rows: number[][]): number[] {
  const n = rows[0].length - 1;
  const normal = Array.from({ length: n }, (_, i) =>
    Array.from({ length: n + 1 }, (_, k) => rows.reduce((sum, row) => sum + row[i] * row[k], i === k ? DAMPING : 0)));
  return eliminated(normal, 0) ?? new Array<number>(n).fill(0);
}

/** Solves n rows by elimination with pivots; null if a pivot is not greater than `least`. */
function eliminated(rows: number[][], least: number): number[] | null {
  const M = rows.map((row) => row.slice());
  const n = M.length;
  for (let c = 0; c < n; c++) {
    let pivot = c;
    for (let r = c + 1; r < n; r++) if (Math.abs(M[r][c]) > Math.abs(M[pivot][c])) pivot = r;
    if (!(Math.abs(M[pivot][c]) > least)) return null;
    [M[c], M[pivot]] = [M[pivot], M[c]];
    for (let r = c + 1; r < n; r++) {
      const factor = M[r][c] / M[c][c];
      if (factor) for (let k = c; k <= n; k++) M[r][k] -= factor * M[c][k];
    }
  }
  const x = new Array<number>(n).fill(0);
  for (let r = n - 1; r >= 0; r--) x[r] = (M[r][n] - dotted(M[r].slice(r + 1, n), x.slice(r + 1))) / M[r][r];
  return x;
}
