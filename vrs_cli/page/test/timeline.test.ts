import { expect, test } from "vitest";
import { Timeline } from "../src/core/timeline";

const motion = { number: 1, kind: "Begin" };
const rest = (start: number, finish: number, at: number) => ({ start, finish, phase: "hold", joints: [[at]] });

test("a change drops, puts in and shifts", () => {
  const timeline = new Timeline();
  timeline.replace({ version: 3, segments: [{ ...rest(0, 1, 0), motion }, rest(1, 2, 1), rest(2, 3, 2)] }, 7);
  const delta = { version: 3, motion: { number: 2, kind: "Move" }, cut: 0.5, keep: 1, drop: 1, segments: [rest(0.5, 1.5, 5)], shift: -0.5 };
  expect(timeline.apply(delta, 8)).toBe(true);
  expect(timeline.segments.map((s) => [s.start, s.finish])).toEqual([[0, 0.5], [0.5, 1.5], [1.5, 2.5]]);
  expect(timeline.locate(1)[0].motion.number).toBe(2);
});

test("a change that does not fit is refused", () => {
  const timeline = new Timeline();
  timeline.replace({ version: 3, segments: [{ ...rest(0, 1, 0), motion }] }, 7);
  expect(timeline.apply({ version: 3, motion: 1, cut: 1, keep: 1, drop: 0, segments: [] }, 9)).toBe(false);
});
