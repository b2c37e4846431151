import { expect, test } from "vitest";
import { frames, type Model } from "../src/core/kinematics";
import { Timeline, value, type SegmentRecord } from "../src/core/timeline";
import type { Point } from "../src/core/transform";
import { opened } from "../src/scene/figure";
import { arrange } from "../src/scene/labels";
import { ERROR, Way, distanceFromLine, gather } from "../src/scene/path";
import { QUALITIES, QualityControl } from "../src/scene/quality";

const model: Model = {
  name: "arm", title: "arm", poses: {},
  joints: [
    { a: 0, d: 0.4, alpha: -Math.PI / 2, lower: -3, upper: 3 },
    { a: 0.45, d: 0.1, alpha: 0, lower: -3, upper: 3 },
    { a: 0.05, d: 0, alpha: Math.PI / 2, lower: -3, upper: 3 },
    { a: 0, d: 0.1, alpha: 0, kind: "prismatic", lower: 0, upper: 0.5 },
  ],
};

/** Returns a generator of numbers from 0 to 1 (mulberry32). */
function random(seed: number): () => number {
  return () => {
    seed = (seed + 0x6d2b79f5) | 0;
    let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

/** Returns a motion of all joints by quintics between random postures, with a tool and a base. */
function records(next: () => number, count: number): SegmentRecord[] {
  let q = model.joints.map(() => next() - 0.5);
  let start = 0;
  return Array.from({ length: count }, (_, number) => {
    const duration = Math.round(1024 * (0.2 + 3 * next())) / 1024; // on the grid of times, so that shifts are exact
    const to = model.joints.map(({ kind }) => (kind ? 0.5 : 5) * (next() - 0.5));
    const joints = q.map((a, i) => [a, 0, 0, (10 * (to[i] - a)) / duration ** 3, (-15 * (to[i] - a)) / duration ** 4, (6 * (to[i] - a)) / duration ** 5]);
    const motion = { number, kind: "joint", frames: { base: [[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0]], tool: [[1, 0, 0, 0.05], [0, 1, 0, 0], [0, 0, 1, 0.1]] } };
    const record = { start, finish: start + duration, phase: number % 3 ? "cruise" : "blend", joints, motion };
    [start, q] = [record.finish, to];
    return record;
  });
}

/** Returns where the tool is in the world at s, by matrices alone. */
function tipAt(record: SegmentRecord, s: number): Point {
  const all = frames(model, record.joints!.map((polynomial) => value(polynomial, s)));
  const T = all[all.length - 1];
  const [x, y, z] = [0, 4, 8].map((r) => T[r] * 0.05 + T[r + 2] * 0.1 + T[r + 3]);
  return [y - 0.2, -(x - 0.1), z]; // the inverse of the base
}

test("the way is nowhere farther than its error from where the tool goes", () => {
  for (let seed = 1; seed <= 3; seed++) {
    const segments = records(random(seed), 5);
    const timeline = new Timeline();
    timeline.replace({ version: 0, segments });
    const lines = new Way(model).lines(timeline, 0, 60, 0);
    expect(lines.length).toBe(segments.length);
    lines.forEach((line, k) => {
      for (let i = 0; i <= 500; i++) {
        const s = ((line.end - line.begin) * i) / 500;
        const piece = Math.max(1, line.times.findIndex((t) => t >= s));
        const at = tipAt(segments[k], s);
        expect(distanceFromLine(at, line.points[piece - 1], line.points[piece])).toBeLessThanOrEqual(ERROR);
      }
      expect(line.points.length).toBeLessThan(1500);
    });
  }
});

test("an edit computes only the segments that it puts in", () => {
  const segments = records(random(9), 6);
  const timeline = new Timeline();
  timeline.replace({ version: 0, segments }, 1);
  const way = new Way(model);
  way.lines(timeline, -60, 60, 0);
  const before = way.computed;
  const [, , third, fourth] = segments;
  const other = { ...records(random(10), 1)[0], start: third.start, finish: third.start + 1 };
  const shift = third.start + 1 - third.finish;
  expect(timeline.apply({ version: 0, motion: other.motion!, cut: third.start, keep: 2, drop: 1, segments: [other], shift }, 2)).toBe(true);
  const lines = way.lines(timeline, -60, 60, 0);
  expect(way.computed - before).toBe(1);
  expect(lines[3].begin).toBeCloseTo(fourth.start + shift, 12);
  expect(lines.filter((line) => line.starts).length).toBe(lines.length);
});

test("of a way with too many pieces the present is kept", () => {
  const timeline = new Timeline();
  const segments = records(random(3), 150).map((record) => ({ ...record, motion: { ...(record.motion as object), kind: "joint" } as never }));
  timeline.replace({ version: 0, segments });
  const t = timeline.end / 2;
  const lines = new Way(model).lines(timeline, 0, timeline.end, t);
  expect(lines.reduce((sum, line) => sum + line.points.length - 1, 0)).toBeLessThanOrEqual(6000);
  expect(lines.some((line) => line.begin <= t && t <= line.end)).toBe(true);
});

test("labels cover neither each other nor the edge", () => {
  const next = random(4);
  const labels = Array.from({ length: 60 }, () => ({ x: 700 * next(), y: 400 * next(), width: 30 + 90 * next(), height: 18 }));
  const places = arrange(labels, 700, 400);
  const boxes = places.flatMap((at, i) => (at ? [[...at, at[0] + labels[i].width, at[1] + labels[i].height]] : []));
  expect(boxes.length).toBeGreaterThan(20);
  boxes.forEach((a, i) => {
    expect(Math.min(a[0], a[1]) >= 0 && a[2] <= 700 && a[3] <= 400).toBe(true);
    for (const b of boxes.slice(i + 1)) expect(a[0] < b[2] && a[2] > b[0] && a[1] < b[3] && a[3] > b[1]).toBe(false);
  });
  expect(arrange([{ x: -Infinity, y: 10, width: 10, height: 10 }], 700, 400)).toEqual([null]);
});

test("places near to each other share a label", () => {
  const found = gather([{ at: [0, 0, 0], text: "a" }, { at: [0.001, 0, 0], text: "b" }, { at: [1, 0, 0], text: "c" }], 0.01);
  expect(found.map(({ texts }) => texts)).toEqual([["a", "b"], ["c"]]);
});

test("fingers slide, and turn about their point", () => {
  expect(Array.from(opened([{ slide: [0.1, 0, 0] }], 0.5)).slice(3, 4)).toEqual([0.05]);
  const T = opened([{ turn: [0, 0, Math.PI / 2], point: [1, 0, 0] }], 1);
  expect(T[3]).toBeCloseTo(1, 12); // the origin goes about (1, 0, 0) to (1, -1, 0)
  expect(T[7]).toBeCloseTo(-1, 12);
});

test("a slow machine loses quality step by step, and gets it back only when that holds", () => {
  const control = new QualityControl();
  let now = 0;
  const draw = (time: number, count: number): void => {
    for (let i = 0; i < count; i++) control.drawn((now += time), true);
  };
  draw(60, 31);
  expect(control.level).toBe(1);
  draw(60, 300);
  expect(control.level).toBe(QUALITIES.length - 1);
  draw(10, 31);
  expect(control.level).toBe(QUALITIES.length - 1); // too early
  draw(10, 40_000);
  expect(control.level).toBeLessThan(QUALITIES.length - 1);
  const level = control.level;
  for (let i = 0; i < 100; i++) control.drawn((now += 250), false); // the slow timer of a robot at rest
  expect(control.level).toBe(level);
});

test("a motion ends with its last segment", () => {
  const rest = (start: number, finish: number, phase: string, motion: number | { number: number; kind: string }) => ({ start, finish, phase, motion, joints: [[0]] });
  const timeline = new Timeline();
  timeline.replace({ version: 0, segments: [rest(0, 1, "rest", { number: 0, kind: "rest" }), rest(1, 2, "accelerate", { number: 1, kind: "joint" }), rest(2, 3, "decelerate", 1), rest(3, 4, "cruise", { number: 2, kind: "joint" })] });
  expect(timeline.finishAfter(1.5)).toBe(3);
  expect([0.5, 1.5, 3.5, 4.5].map((t) => timeline.moves(t))).toEqual([false, true, true, false]);
});
