/** The twelve numbers of the rows [n s a p] of a homogeneous transformation; metres. */
export type Transform = Float64Array;
export type Point = [number, number, number];

export const identity = (): Transform => Float64Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0);

/** Reads rows, or twelve numbers in a row. */
export const transformOf = (rows: number[][] | number[]): Transform => Float64Array.from((rows as number[][]).flat());

/** Returns a transformation that moves by x, y, z [m] and does not turn. */
export const movedTo = ([x, y, z]: ArrayLike<number> & Iterable<number>): Transform => Float64Array.of(1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z);

/** Returns column c of the rotation: 0 n, 1 s, 2 a; or 3, the place of the origin [m]. */
export const column = (T: ArrayLike<number>, c: number): Point => [T[c], T[4 + c], T[8 + c]];

/** Returns where the origin is [m]. */
export const originOf = (T: ArrayLike<number>): Point => column(T, 3);

/** Multiplies A B. */
export function multiply(A: Transform, B: Transform): Transform {
  const C = new Float64Array(12);
  for (let r = 0; r < 12; r += 4) {
    const [a, b, c] = [A[r], A[r + 1], A[r + 2]];
    for (let k = 0; k < 4; k++) C[r + k] = a * B[k] + b * B[4 + k] + c * B[8 + k] + (k === 3 ? A[r + 3] : 0);
  }
  return C;
}

/** Returns the rotation about a unit axis by an angle [rad]. */
export function rotation(axis: number[], angle: number): Transform {
  const [x, y, z] = axis;
  const [c, s, v] = [Math.cos(angle), Math.sin(angle), 1 - Math.cos(angle)];
  return Float64Array.of(
    c + x * x * v, x * y * v - z * s, x * z * v + y * s, 0,
    y * x * v + z * s, c + y * y * v, y * z * v - x * s, 0,
    z * x * v - y * s, z * y * v + x * s, c + z * z * v, 0,
  );
}

/** Inverts a rigid transformation. */
export function inverse(T: Transform): Transform {
  const R = Float64Array.of(T[0], T[4], T[8], 0, T[1], T[5], T[9], 0, T[2], T[6], T[10], 0);
  for (let r = 0; r < 12; r += 4) R[r + 3] = -(R[r] * T[3] + R[r + 1] * T[7] + R[r + 2] * T[11]);
  return R;
}

/** Returns by how much A and B are turned against each other [rad]. */
export function angleBetween(A: Transform, B: Transform): number {
  const squares = A.map((x, i) => (i % 4 === 3 ? 0 : (x - B[i]) ** 2)).reduce((sum, one) => sum + one);
  return 2 * Math.asin(Math.min(Math.sqrt(squares / 8), 1));
}

/** Returns where T takes a point [m]. */
export const movePoint = (T: Transform, [x, y, z]: Iterable<number>): Point => [
  T[0] * x + T[1] * y + T[2] * z + T[3], T[4] * x + T[5] * y + T[6] * z + T[7], T[8] * x + T[9] * y + T[10] * z + T[11],
];
