import { expect, test } from "vitest";
import { Timeline } from "../src/core/timeline";
import { World, type ContactSpan, type CourseRows } from "../src/core/world";
import recorded from "./recorded_world.json";

/** A course of programs/sorting.v2 and what vrs_cli/world says of it at some times. */
interface Look { t: number; flange: number[]; parts: Record<string, number[] | null>; held: string | null; opening: number }
const { course, looks } = recorded as unknown as { course: { rows: CourseRows; touches: ContactSpan[]; until: number | null }; looks: Look[] };

const check = (world: World, { t, flange, parts, held, opening }: Look): void => {
  for (const [name, wanted] of Object.entries(parts)) {
    const found = world.pose(name, t, Float64Array.from(flange));
    expect(!!found).toBe(!!wanted);
    wanted?.forEach((x, i) => expect(found![i]).toBeCloseTo(x, 12));
  }
  expect(world.held(t)).toBe(held);
  expect(world.opening(t)).toBe(opening);
};

test("parts and hand are where the world of vrs has them", () => {
  const world = World.of(course.rows, course.touches, course.until);
  expect(looks.some((look) => look.held)).toBe(true);
  for (const look of looks) check(world, look);
});

test("what is told anew from a time on takes the place of what was", () => {
  const world = World.of(course.rows, course.touches, course.until);
  const since = looks[looks.length - 1].t;
  const later: CourseRows = { parts: {}, grips: (course.rows.grips ?? []).filter(([t]) => t >= since) };
  for (const [name, rows] of Object.entries(course.rows.parts!)) later.parts![name] = rows.filter(([t]) => t >= since);
  world.hear({ type: "course", rows: { parts: { wrong: [[since, "rests", [], []]] } }, since });
  world.hear({ type: "course", rows: later, since });
  expect(world.pose("wrong", since + 1, Float64Array.from(looks[0].flange))).toBeNull();
  for (const look of looks) check(world, look);
});

test("sensors are on from one row to the next, and contacts are replaced in a stretch of time", () => {
  const world = new World();
  world.hear({ type: "course", rows: { sensors: { 0: [[1, true], [2, false]] } }, until: 5 });
  expect([0.9, 1, 1.9, 2].map((t) => world.sees(0, t))).toEqual([false, true, true, false]);
  world.hear({ type: "contacts", touches: [[1, null, "hand", "table"]], since: 0 });
  world.hear({ type: "contacts", touches: [[3.25, 3.5, "link 3", "box"]], since: 3, until: 4 });
  expect(world.touching(2)).toEqual([["hand", "table"]]);
  expect(world.touching(3.1)).toEqual([]);
  expect(world.touching(3.2, 0.1)).toEqual([["link 3", "box"]]);
  expect(world.touching(9)).toEqual([["hand", "table"]]);
});

test("fingers move until they stop at the part that they take", () => {
  const world = World.of({ grips: [[0, null, 1], [2.5, "box", 0.5]] }, null, null);
  const timeline = new Timeline();
  timeline.replace({ version: 0, segments: [], events: [{ time: 2, channel: 0, value: 0, duration: 0.5 }] });
  expect([1.9, 2, 2.25, 2.5, 9].map((t) => timeline.hand(t, (at) => world.opening(at)))).toEqual([1, 1, 0.75, 0.5, 0.5]);
  timeline.events.push({ time: 4, channel: 0, value: 1 });
  expect([1.9, 2, 2.25, 2.5, 9].map((t) => timeline.hand(t))).toEqual([0, 0, 0, 0, 1]);
});
