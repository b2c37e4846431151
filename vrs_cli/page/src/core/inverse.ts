import { type Model, frames, slides } from "./kinematics";
import { type Line, value } from "./timeline";
import { type Transform, inverse, multiply, rotation, transformOf } from "./transform";

const STEPS = 20; // of Newton's method: from a seed it takes 2 to 4
const EXACT = 1e-14; // [m, rad] of what is missing, and of a step: there is no less
const SINGULAR = 1e-9; // of the largest entry: a pivot that is none
const DAMPING = 1e-14; // where the joints are singular
const LARGEST_STEP = 0.5; // [rad, m]

type Vector = [number, number, number];

/** Which of X, Y, Z of the robot's frame and of the turns about X, Y, Z of the flange count for a task. */
const COUNTS: Record<string, string> = {
  pose: "111111", pointing: "111110", upright: "111001", position: "111000", steady: "111111",
};

/** Returns T_robot_tool of a line at s. */
export function linePose(line: Line, s: number): Transform {
  let T = transformOf(line.orientation);
  T[3] = T[7] = T[11] = 0;
  for (const turn of line.turns) T = multiply(T, rotation(turn.axis, value(turn.angle, s)));
  for (let i = 0; i < 3; i++) T[3 + 4 * i] = value(line.position[i], s);
  return T;
}

/** The joints on a line at s [rad, m], the steps that it took, and what is missing [m, rad]. */
export interface Found {
  q: number[];
  steps: number;
  missing: number;
}

/** Finds the joints on a line at s by Newton's method from its seeds. `tool`: T_flange_tool. */
export function jointsOnLine(model: Model, line: Line, s: number, tool?: Transform): Found {
  const want = linePose(line, s);
  const q = startOn(line, s);
  if (model.task === "steady") return steadyJoints(model, want, tool, q);
  const flange = tool ? multiply(want, inverse(tool)) : want;
  const counts = countsOf(model);
  const guides = line.guides ?? [];
  const n = q.length;
  const places = [...counts].filter((count) => count === "1").length;
  const A = new Float64Array((places + guides.length) * (n + 1));
  let [missing, steps] = [Infinity, 0];
  for (; steps < STEPS; steps++) {
    missing = equations(model, frames(model, q), flange, counts, A);
    for (let k = 0; k < guides.length; k++) {
      const row = (places + k) * (n + 1);
      let left = value(guides[k].value, s);
      for (let j = 0; j < n; j++) {
        A[row + j] = guides[k].weights[j];
        left -= A[row + j] * q[j];
      }
      A[row + n] = left;
      missing = Math.max(missing, Math.abs(left));
    }
    if (missing < EXACT || !goOn(q, solve(A, n))) break;
  }
  return { q, steps, missing };
}

/** Between the two seeds around s; where they are apart by more than a little, at the nearer one. */
function startOn(line: Line, s: number): number[] {
  const { seeds } = line;
  const last = seeds.length - 1;
  const x = last ? Math.min(Math.max(s / line.seed_interval, 0), last) : 0;
  const [a, b] = [seeds[Math.floor(x)], seeds[Math.min(Math.floor(x) + 1, last)]];
  const part = x - Math.floor(x);
  const apart = a.some((from, i) => Math.abs(b[i] - from) > LARGEST_STEP);
  if (apart) return seeds[Math.round(x)].slice();
  return a.map((from, i) => from + part * (b[i] - from));
}

/** Adds a step to q, at most `LARGEST_STEP`; false where it is too small to change anything. */
function goOn(q: number[], step: ArrayLike<number>): boolean {
  const most = largest(step);
  const scale = most > LARGEST_STEP ? LARGEST_STEP / most : 1;
  for (let i = 0; i < q.length; i++) q[i] += scale * step[i];
  return most > EXACT;
}

/** Writes the rows of the Jacobian that count for the flange, each with what is missing in it, to A; returns the most
 * that is missing [m, rad]. */
function equations(model: Model, F: Transform[], want: Transform, counts: string, A: Float64Array): number {
  const n = model.joints.length;
  const have = F[n];
  const turn = counts === COUNTS.pointing ? turnBetween(column(have, 2), column(want, 2)) : rotationVector(have, want);
  const J = jacobian(model, F, have[3], have[7], have[11]);
  let [row, most] = [0, 0];
  for (let k = 0; k < 6; k++) {
    if (counts[k] === "0") continue;
    let missing: number;
    if (k < 3) missing = want[3 + 4 * k] - have[3 + 4 * k];
    else missing = counts === COUNTS.pose ? turn[k - 3] : have[k - 3] * turn[0] + have[k + 1] * turn[1] + have[k + 5] * turn[2];
    for (let j = 0; j < n; j++) {
      const o = 6 * j;
      A[row + j] = k < 3 || counts === COUNTS.pose ? J[o + k] : have[k - 3] * J[o + 3] + have[k + 1] * J[o + 4] + have[k + 5] * J[o + 5];
    }
    A[row + n] = missing;
    most = Math.max(most, Math.abs(missing));
    row += n + 1;
  }
  return most;
}

/** The geometric Jacobian of a point [m] in the robot's frame: velocity and angular velocity, joint after joint. */
function jacobian(model: Model, F: Transform[], x: number, y: number, z: number): Float64Array {
  const n = model.joints.length;
  const J = new Float64Array(6 * n);
  for (let j = 0; j < n; j++) {
    const T = F[j];
    const o = 6 * j;
    const zx = T[2];
    const zy = T[6];
    const zz = T[10];
    if (slides(model.joints[j])) {
      J[o] = zx;
      J[o + 1] = zy;
      J[o + 2] = zz;
      continue;
    }
    const px = x - T[3];
    const py = y - T[7];
    const pz = z - T[11];
    J[o] = zy * pz - zz * py;
    J[o + 1] = zz * px - zx * pz;
    J[o + 2] = zx * py - zy * px;
    J[o + 3] = zx;
    J[o + 4] = zy;
    J[o + 5] = zz;
  }
  return J;
}

const countsOfModel = new WeakMap<Model, string>();

/** Returns which parts of a pose count, of a planar arm those in its plane. */
function countsOf(model: Model): string {
  let counts = countsOfModel.get(model);
  if (counts === undefined) {
    const task = model.task ?? "pose";
    counts = task === "point" || task === "plane" ? inPlane(model, task === "plane") : (COUNTS[task] ?? COUNTS.pose);
    countsOfModel.set(model, counts);
  }
  return counts;
}

/** The two coordinates in the plane of an arm, and the turn about the axis of the flange that is nearest its normal. */
function inPlane(model: Model, turns: boolean): string {
  const F = frames(model, model.joints.map(() => 0));
  const axes = model.joints.map((_, j) => column(F[j], 2));
  const turning = axes.filter((_, j) => !slides(model.joints[j]));
  const sliding = axes.filter((_, j) => slides(model.joints[j]));
  const across = sliding.flatMap((a, i) => sliding.slice(i + 1).map((b) => crossed(a, b))).filter((v) => Math.hypot(...v) > 1e-9);
  const normal = [...turning, ...across][0];
  if (!normal) return turns ? COUNTS.upright : COUNTS.position;
  const most = (lengths: number[]): number => lengths.indexOf(Math.max(...lengths));
  const out = most(normal.map(Math.abs));
  const about = most([0, 1, 2].map((k) => Math.abs(dotted(column(F[F.length - 1], k), normal))));
  return [0, 1, 2].map((k) => (k === out ? "0" : "1")).join("") + [0, 1, 2].map((k) => (turns && k === about ? "1" : "0")).join("");
}

// --- the tool turned as nearly as the arm can -----------------------------------------------------------------------

/** Finds the joints of an arm of four or five joints that bring the tip of its tool to the place exactly, turned as
 * nearly as it can: 1 - cos of the turn that is missing has the least value among the joints that reach the place.
 *
 * With the rows P and O of what each joint does to place and direction, the missing turn's axis e as long as its sine,
 * and multipliers l: P l = O e, and the place is reached (Lagrange's conditions). The system of the next joints and
 * multipliers is solved until nothing changes; vrs_cli/kinematics/numeric/steady/conditions.py has the derivation.
 */
function steadyJoints(model: Model, want: Transform, tool: Transform | undefined, q: number[]): Found {
  const n = q.length;
  // what the tool turns does not count: the turn is that of the flange, the place that of the tip
  const flange = tool ? multiply(want, inverse(tool)) : want;
  const reach: Vector = tool ? [tool[3], tool[7], tool[11]] : [0, 0, 0];
  let multipliers: Float64Array | undefined;
  let [missing, steps] = [Infinity, 0];
  for (; steps < STEPS; steps++) {
    const F = frames(model, q);
    const have = F[n];
    const tip = movedBy(have, reach);
    const J = jacobian(model, F, ...tip);
    const place = q.map((_, j): Vector => [J[6 * j], J[6 * j + 1], J[6 * j + 2]]);
    const turn = q.map((_, j): Vector => [J[6 * j + 3], J[6 * j + 4], J[6 * j + 5]]);
    const away = [want[3] - tip[0], want[7] - tip[1], want[11] - tip[2]];
    const M = turnLeft(have, flange); // R W^T
    const sine: Vector = [0.5 * (M[1][2] - M[2][1]), 0.5 * (M[2][0] - M[0][2]), 0.5 * (M[0][1] - M[1][0])];
    const pull = turn.map((o) => dotted(o, sine));
    multipliers ??= leastSquares(flat(place.map((p, i) => [...p, pull[i]])), 3);
    const trace = M[0][0] + M[1][1] + M[2][2];
    const rows: number[][] = [];
    for (let i = 0; i < n; i++) {
      const row = new Array<number>(n + 4).fill(pull[i]);
      for (let k = 0; k < n; k++) {
        const [first, later] = i < k ? [i, k] : [k, i];
        const bent = dotted(crossed(turn[first], place[later]), multipliers);
        const turned = i > k ? dotted(crossed(turn[k], turn[i]), sine) : 0;
        let direct = 0;
        for (let a = 0; a < 3; a++) {
          for (let b = 0; b < 3; b++) direct += turn[i][a] * 0.5 * (M[a][b] - (a === b ? trace : 0)) * turn[k][b];
        }
        row[k] = bent - turned - direct;
      }
      for (let c = 0; c < 3; c++) row[n + c] = place[i][c];
      rows.push(row);
    }
    for (let c = 0; c < 3; c++) rows.push([...place.map((p) => p[c]), 0, 0, 0, away[c]]);
    const next = solve(flat(rows), n + 3);
    multipliers = next.subarray(n);
    missing = largest(away);
    if (!goOn(q, next.subarray(0, n))) break;
  }
  return { q, steps, missing };
}

/** R_have R_want^T. */
function turnLeft(have: Transform, want: Transform): number[][] {
  const of = (T: Transform, r: number): Vector => [T[4 * r], T[4 * r + 1], T[4 * r + 2]];
  return [0, 1, 2].map((r) => [0, 1, 2].map((c) => dotted(of(have, r), of(want, c))));
}

const movedBy = (T: Transform, p: Vector): Vector =>
  [0, 1, 2].map((r) => T[4 * r] * p[0] + T[4 * r + 1] * p[1] + T[4 * r + 2] * p[2] + T[4 * r + 3]) as Vector;

// --- turns and equations --------------------------------------------------------------------------------------------

const column = (T: Transform, c: number): Vector => [T[c], T[4 + c], T[8 + c]];
const dotted = (a: ArrayLike<number>, b: ArrayLike<number>): number => {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i] * b[i];
  return sum;
};
const crossed = ([a, b, c]: Vector, [x, y, z]: Vector): Vector => [b * z - c * y, c * x - a * z, a * y - b * x];
const largest = (v: ArrayLike<number>): number => {
  let most = 0;
  for (let i = 0; i < v.length; i++) most = Math.max(most, Math.abs(v[i]));
  return most;
};

/** Returns the rotation vector of R_want R_have^T [rad]. */
function rotationVector(have: Transform, want: Transform): Vector {
  const sum: Vector = [0, 0, 0];
  let trace = 0;
  for (let c = 0; c < 3; c++) {
    const [h, w] = [column(have, c), column(want, c)];
    const v = crossed(h, w);
    for (let k = 0; k < 3; k++) sum[k] += 0.5 * v[k];
    trace += dotted(h, w);
  }
  return asLongAsAngle(sum, 0.5 * (trace - 1));
}

/** Returns the shortest rotation vector that brings direction a to b [rad]. */
const turnBetween = (a: Vector, b: Vector): Vector => asLongAsAngle(crossed(a, b), dotted(a, b));

/** Makes a rotation vector that is as long as the sine of its angle as long as the angle. */
function asLongAsAngle(v: Vector, cosine: number): Vector {
  const sine = Math.hypot(...v);
  if (sine < 1e-12) return cosine > 0 ? v : [1e-3, 0, 0]; // half a turn: about any axis, the next step sees which
  const factor = Math.atan2(sine, cosine) / sine;
  return [v[0] * factor, v[1] * factor, v[2] * factor];
}

const flat = (rows: number[][]): Float64Array => Float64Array.from(rows.flat());

/** Solves rows of n coefficients and a right side by elimination with pivots; where they are singular, or not n, by
 * least squares. */
function solve(A: Float64Array, n: number): Float64Array {
  const w = n + 1;
  if (A.length !== n * w) return leastSquares(A, n);
  const M = A.slice();
  let scale = 0;
  for (let r = 0; r < n; r++) for (let c = 0; c < n; c++) scale = Math.max(scale, Math.abs(M[r * w + c]));
  for (let c = 0; c < n; c++) {
    let pivot = c;
    for (let r = c + 1; r < n; r++) if (Math.abs(M[r * w + c]) > Math.abs(M[pivot * w + c])) pivot = r;
    if (Math.abs(M[pivot * w + c]) < SINGULAR * scale) return leastSquares(A, n);
    if (pivot !== c) {
      for (let k = c; k < w; k++) {
        const x = M[c * w + k];
        M[c * w + k] = M[pivot * w + k];
        M[pivot * w + k] = x;
      }
    }
    for (let r = c + 1; r < n; r++) {
      const factor = M[r * w + c] / M[c * w + c];
      if (factor) for (let k = c; k < w; k++) M[r * w + k] -= factor * M[c * w + k];
    }
  }
  const x = new Float64Array(n);
  for (let r = n - 1; r >= 0; r--) {
    let sum = M[r * w + n];
    for (let k = r + 1; k < n; k++) sum -= M[r * w + k] * x[k];
    x[r] = sum / M[r * w + r];
  }
  return x;
}

/** Solves the normal equations of such rows, slightly damped, by Cholesky's method. */
function leastSquares(A: Float64Array, n: number): Float64Array {
  const w = n + 1;
  const L = new Float64Array(n * n);
  const x = new Float64Array(n);
  for (let i = 0; i < n; i++) {
    for (let r = 0; r < A.length; r += w) x[i] += A[r + i] * A[r + n];
    for (let j = 0; j <= i; j++) {
      let sum = i === j ? DAMPING : 0;
      for (let r = 0; r < A.length; r += w) sum += A[r + i] * A[r + j];
      for (let k = 0; k < j; k++) sum -= L[i * n + k] * L[j * n + k];
      L[i * n + j] = i === j ? Math.sqrt(Math.max(sum, DAMPING)) : sum / L[j * n + j];
    }
  }
  for (let i = 0; i < n; i++) {
    for (let k = 0; k < i; k++) x[i] -= L[i * n + k] * x[k];
    x[i] /= L[i * n + i];
  }
  for (let i = n - 1; i >= 0; i--) {
    for (let k = i + 1; k < n; k++) x[i] -= L[k * n + i] * x[k];
    x[i] /= L[i * n + i];
  }
  return x;
}
