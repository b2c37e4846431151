import { expect, test } from "vitest";
import type { Playback } from "../src/core/playback";
import { PHASES, commandFrom, commandsIn, roundStep, shares, spanOf } from "../src/core/spans";
import { Timeline } from "../src/core/timeline";

const N = PHASES.length;

/** A timeline of so many motions of 1 s each: a quarter accelerates, half cruises, a quarter decelerates. */
function motions(count: number): Timeline {
  const timeline = new Timeline();
  const segments = Array.from({ length: count }, (_, i) =>
    [["accelerate", 0, 0.25], ["cruise", 0.25, 0.75], ["decelerate", 0.75, 1]].map(([phase, from, to]) => ({
      start: i + (from as number), finish: i + (to as number), phase: phase as string, joints: [[0]], motion: { number: i, kind: "Move", text: `MOVE p${i}` },
    }))).flat();
  timeline.replace({ version: 0, segments });
  return timeline;
}

test("each column has the share of each phase", () => {
  const found = shares(motions(2), { low: 0, high: 4 }, 8);
  const column = (i: number): number[] => [...found.slice(i * N, i * N + N)];
  expect(PHASES[2]).toBe("accelerate");
  expect(column(0)).toEqual([0, 0.5, 0.5, 0, 0]);
  expect(column(1)).toEqual([0, 0.5, 0, 0.5, 0]);
  expect(column(4)).toEqual([0, 0, 0, 0, 0]);
});

test("10,000 motions become a density in a few milliseconds", () => {
  const timeline = motions(10_000);
  const began = performance.now();
  const found = shares(timeline, { low: 0, high: 10_000 }, 1400);
  const commands = commandsIn(timeline, { low: 0, high: 10_000 });
  expect(performance.now() - began).toBeLessThan(500);
  expect(commands.length).toBe(10_000);
  for (const i of [0, 700, 1399]) {
    expect(found[i * N + 1]).toBeCloseTo(0.5, 1);
    expect(found[i * N + 2] + found[i * N + 3]).toBeCloseTo(0.5, 1);
  }
});

test("commands of a span, and from one to the next", () => {
  const timeline = motions(4);
  expect(commandsIn(timeline, { low: 1, high: 3 }).map(({ text }) => text)).toEqual(["MOVE p1", "MOVE p2"]);
  expect([commandFrom(timeline, 1, 1), commandFrom(timeline, 1, -1), commandFrom(timeline, 3.5, 1), commandFrom(timeline, 2.5, -1)]).toEqual([2, 0, 4, 2]);
});

test("spans are between round times", () => {
  const playback = { begin: 0.3, end: 61.2 } as Playback;
  expect(roundStep(60.9, 20)).toBe(5);
  expect(spanOf(playback, Infinity, 0)).toEqual({ low: 0, high: 65 });
  expect(spanOf(playback, 20, 45)).toEqual({ low: 40, high: 60 });
});
