import { expect, test } from "vitest";
import { Playback } from "../src/core/playback";
import type { Source } from "../src/core/source";

test("a motion that is done at once in virtual time is played, and no further", () => {
  let [wall, now] = [100, 0];
  let changed = (): void => {};
  const source = {
    live: true, passes: false, now: () => now, timeline: { begin: 0, get end() { return now; }, segments: [] },
    onChange: (heard: () => void) => { changed = heard; },
  };
  const playback = new Playback(source as unknown as Source, () => {}, () => wall);
  expect([playback.following, playback.time, playback.moves]).toEqual([true, 0, false]);
  wall = 107;
  now = 2;
  changed();
  expect([playback.time, playback.moves]).toEqual([0, true]);
  wall = 108.5;
  expect(playback.time).toBe(1.5);
  now = 3; // another one while the first is played
  changed();
  expect(playback.time).toBe(1.5);
  wall = 111;
  expect([playback.time, playback.moves]).toEqual([3, false]);
  now = 1; // UNDO
  changed();
  expect([playback.time, playback.moves]).toEqual([1, false]);
});
