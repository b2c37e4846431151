import { expect, test } from "vitest";
import type { Model } from "../src/core/kinematics";
import { Playback } from "../src/core/playback";
import type { Source } from "../src/core/source";
import { Timeline } from "../src/core/timeline";
import { World } from "../src/core/world";

/** A robot whose clock and timeline the test sets: rest to 1 s, a motion to 3 s, another to 5 s. */
class Robot implements Source {
  readonly live = true;
  readonly model = {} as Model;
  readonly timeline = new Timeline();
  readonly title = "cell1";
  readonly cell = null;
  readonly world = new World();
  passes = true;
  clock = 0;
  recalled: number[] = [];
  constructor() {
    const piece = (number: number, start: number, finish: number, phase: string): object => ({ start, finish, phase, motion: { number, kind: "joint" }, joints: [[0]] });
    const segments = [piece(0, 0, 1, "rest"), piece(1, 1, 3, "cruise"), piece(2, 3, 5, "cruise")] as never;
    this.timeline.replace({ version: 0, segments, first: 4 });
  }
  now(): number {
    return this.clock;
  }
  async recall(begin: number): Promise<boolean> {
    return this.recalled.push(begin) < 4;
  }
  onChange(): void {}
}

let wall = 100;
const playing = (robot: Robot): Playback => new Playback(robot, () => {}, () => wall);

test("it follows a clock that passes, until somebody seeks", () => {
  const robot = new Robot();
  const playback = playing(robot);
  robot.clock = 2;
  expect([playback.following, playback.time, playback.moves]).toEqual([true, 2, true]);
  playback.seek(1.5);
  robot.clock = 4;
  expect([playback.following, playback.time, playback.moves]).toEqual([false, 1.5, false]);
  playback.follow();
  expect(playback.time).toBe(4);
  robot.clock = 9;
  expect([playback.time, playback.moves]).toEqual([9, false]);
});

test("a clock that stands is followed to where commands bring it", () => {
  const robot = new Robot();
  robot.passes = false;
  const playback = playing(robot);
  playback.follow();
  robot.clock = 5;
  expect([playback.time, playback.moves]).toEqual([5, false]);
});

test("it plays at its rate, to the end or over and over", () => {
  const robot = new Robot();
  robot.clock = 5;
  const playback = playing(robot);
  playback.seek(1);
  playback.play();
  wall += 1;
  expect(playback.time).toBe(2);
  playback.setRate(2);
  wall += 0.5;
  expect(playback.time).toBe(3);
  wall += 9;
  expect([playback.time, playback.playing]).toEqual([5, false]);
  playback.play();
  playback.seek(5);
  expect(playback.playing).toBe(false); // at once: the next play begins at the start
  playback.loop = true;
  playback.play();
  wall += 0.5;
  expect(playback.time).toBe(playback.begin + 1);
  wall += (playback.end - playback.begin) / 2;
  expect(playback.time).toBeCloseTo(playback.begin + 1, 9);
});

test("whoever goes back to the begin of what is known asks for more, until that is all", async () => {
  const robot = new Robot();
  const playback = playing(robot);
  playback.seek(2);
  expect(robot.recalled).toEqual([]);
  playback.seek(-3);
  expect(playback.time).toBe(playback.begin);
  expect(robot.recalled.length).toBe(1);
  playback.seek(2);
  await new Promise((done) => setImmediate(done));
  expect(robot.recalled.length).toBe(1); // the user has gone elsewhere
  playback.seek(-3);
  await new Promise((done) => setImmediate(done));
  expect([robot.recalled.length, playback.time]).toEqual([4, playback.begin]);
});

test("commands begin where motions do, and the robot moves between", () => {
  const { timeline } = new Robot();
  expect(timeline.begins()).toEqual([0, 1, 3]);
  expect([0.5, 2, 5, 6].map((t) => timeline.moves(t))).toEqual([false, true, false, false]);
});
