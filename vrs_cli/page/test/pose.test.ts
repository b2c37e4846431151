import { expect, test } from "vitest";
import { fixed, oat, speedsAt } from "../src/core/pose";
import type { Model } from "../src/core/kinematics";
import { Timeline } from "../src/core/timeline";
import { movedTo, multiply } from "../src/core/transform";

/** Rotations by rows, and to_oat of vrs_cli/kinematics/transform.py for them [rad]. */
const ANGLES: [number[], number[]][] = [
  [[1, 0, 0, 0, 1, 0, 0, 0, 1], [1.5707963267948966, -1.5707963267948966, 0]],
  [[1, 0, 0, 0, -1, -1.2246467991473532e-16, 0, 1.2246467991473532e-16, -1], [1.5707963267948966, 1.5707963267948966, 3.141592653589793]],
  [[6.123233995736766e-17, 0, 1, 0, 1, 0, -1, 0, 6.123233995736766e-17], [1.5707963267948966, 0, 0]],
  [[1, 0, 0, 0, 6.123233995736766e-17, -1, 0, 1, 6.123233995736766e-17], [0, 0, 1.5707963267948966]],
  [[-1, -1.2246467991473532e-16, 0, 1.2246467991473532e-16, -1, 0, 0, 0, 1], [1.5707963267948966, -1.5707963267948966, 3.141592653589793]],
  [[-0.6754239084666136, -0.6954037144679854, -0.24538993006195678, 0.2803599741217196, -0.5499287867776776, 0.7867506684990488, -0.6820563237608404, 0.46259269706444783, 0.5663984179360741], [-2.8392517216847413, -0.6021291043578958, 0.595966966051824]],
  [[-0.67171868909165, 0.7381180763018442, -0.0630532169001721, -0.7388361084450088, -0.6737046062804279, -0.015598343962380247, -0.05399266230545146, 0.0361082942410515, 0.9978882620334659], [-1.328281487761231, -1.505796609489375, 0.5894524999584223]],
  [[-0.38252487983006933, 0.9202278515925821, -0.08279744841655157, 0.9186059286418198, 0.3691642295989771, -0.14099971435677972, -0.09918600796024987, -0.1299941257822608, -0.9865412627391796], [-0.5309673097379979, 1.4065462998017741, -0.9190246189038711]],
  [[0.5940966909683585, 0.7307498248562698, 0.3362347621126908, -0.07924379962892796, -0.36279608387023143, 0.9284930919230333, 0.8004808192585361, -0.5782591936155923, -0.1576285602237991], [2.794153151298779, 0.15828872847641673, -2.515997477802008]],
  [[-0.7816839493962761, 0.623635992082205, -0.006953605962674436, -0.2932685108727673, -0.3773856658982396, -0.8783926455207898, -0.5504214601436882, -0.6845861586054646, 0.47788911648948856], [-0.00791611900261846, -0.49825009187502856, -0.8936085264604938]],
];

test.each(ANGLES)("O, A, T of %j", ([nx, sx, ax, ny, sy, ay, nz, sz, az], angles) => {
  const found = oat(Float64Array.of(nx, sx, ax, 1, ny, sy, ay, 2, nz, sz, az, 3));
  found.forEach((angle, i) => {
    expect(angle).toBeCloseTo(angles[i], 12);
    expect(Object.is(angle, -0)).toBe(false);
  });
});

test.each([[-0.04, 1, "0.0"], [-0.06, 1, "-0.1"], [0, 2, "0.00"], [-0, 0, "0"], [12.345, 1, "12.3"]])("%d with %d digits", (x, digits, text) => {
  expect(fixed(x, digits)).toBe(text);
});

const ARM: Model = {
  name: "planar2", title: "", poses: {},
  joints: [{ a: 0.5, d: 0, alpha: 0, lower: -3, upper: 3 }, { a: 0.25, d: 0, alpha: 0, lower: -3, upper: 3 }],
};
const BASE = [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0]];

test("speeds of joints and tool, and the tool in the world", () => {
  const timeline = new Timeline();
  const motion = { number: 1, kind: "Move", frames: { base: BASE } };
  const segments = [
    { start: 0, finish: 1, phase: "cruise", motion, joints: [[0, 2], [0]] },
    { start: 1, finish: 2, phase: "rest", joints: [[2], [0]] },
  ];
  timeline.replace({ version: 0, segments });
  const moving = speedsAt(ARM, timeline, 0.5);
  expect(moving.joints).toEqual([2, 0]);
  expect(moving.tool).toBeCloseTo(2 * 0.75, 6);
  expect(speedsAt(ARM, timeline, 1.5)).toEqual({ joints: [0, 0], tool: 0 });
  expect(speedsAt(ARM, timeline, 9)).toEqual({ joints: [0, 0], tool: 0 });
  expect(multiply(timeline.base(0.5), movedTo([0.75, 0, 0]))[3]).toBeCloseTo(0.65, 12);
});
