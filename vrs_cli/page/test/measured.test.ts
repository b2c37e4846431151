import { expect, test, vi } from "vitest";
import { ServerClock } from "../src/core/connection";
import type { Connection, Message } from "../src/core/connection";
import type { Model } from "../src/core/kinematics";
import { Measured, between, residualOf } from "../src/core/measured";
import { LiveSource } from "../src/core/source";
import { Timeline } from "../src/core/timeline";
import { alarmOf, bodyOf, countsOf } from "../src/panels/body";
import { leadNote } from "../src/panels/delays";

/** A connection whose messages and answers are what a test says. */
function heard(answer: (fields: Message) => Message): [Measured, (topic: string, message: Message) => void, Message[]] {
  const listeners = new Map<string, (message: Message) => void>();
  const asked: Message[] = [];
  const connection = {
    state: "open", welcome: { life: "a" },
    on: (topic: string, f: (message: Message) => void) => void listeners.set(topic, f),
    ask: (_type: string, fields: Message) => (asked.push(fields), Promise.resolve(answer(fields))),
  };
  return [new Measured(connection as unknown as Connection), (topic, message) => listeners.get(topic)!(message), asked];
}
const rows = (times: number[]): Message => ({ times, joints: times.map((t) => [t ** 3]), velocity: times.map((t) => [3 * t ** 2]) });

test("between reports with velocities the joints are a cubic polynomial, else a straight line; in gaps they are unknown", () => {
  const at = (t: number, v?: number[]) => ({ t, q: [t ** 3], v });
  const smooth = [at(1, [3]), at(1.4, [3 * 1.96]), at(2, [12])];
  expect(between(smooth, 1.3)!.q[0]).toBeCloseTo(1.3 ** 3, 12);
  expect(between([at(1, [3]), at(1.4)], 1.1)!.q[0]).toBeCloseTo(1 + (1.4 ** 3 - 1) / 4, 12);
  expect(between(smooth, 1.5), "0.6 s without a report").toBeNull();
  for (const t of [0.9, 2.1]) expect(between(smooth, t), "before the first, after the last").toBeNull();
  for (const one of smooth) expect(between(smooth, one.t)).toBe(one);
});

test("what was measured before is asked for where it is shown, and again after a gap; a new life of the robot forgets all", async () => {
  const [measured, tell, asked] = heard(({ begin }) => ({ parts: begin < 2 ? [rows([0.5, 0.75, 1])] : [] }));
  expect(measured.at(0.6), "nobody asks as long as there is no body").toBeNull();
  expect(asked).toEqual([]);
  tell("bodystatus", { body: { name: "arm" } });
  tell("measurements", { first: 70, ...rows([30, 30.25]) });
  expect(measured.at(0.6)).toBeNull();
  expect(asked).toEqual([{ begin: 0, end: 20.5 }]);
  await Promise.resolve();
  await Promise.resolve();
  expect(measured.at(0.6)!.q[0]).toBeCloseTo(0.216, 12);
  expect(measured.at(30.1)!.q[0]).toBeCloseTo(30.1 ** 3, 9);
  expect(asked.length).toBe(2);
  tell("measurements", { first: 72, ...rows([30.5]) });
  measured.at(30.1);
  expect(asked.length, "none is missing").toBe(2);
  tell("measurements", { first: 80, ...rows([31]) });
  measured.at(30.1);
  expect(asked.length, "seven are missing").toBe(3);
  tell("measurements", { first: 81, ...rows([30.75]) });
  expect(measured.at(30.9)!.q[0], "a late report is in its place").toBeCloseTo(30.9 ** 3, 9);
  expect(measured.last!.t).toBe(31);
  tell("alarm", { alarm: { t: 30 } });
  tell("told", { reply: { kind: "Message" } });
  expect(measured.alarms).toEqual([{ t: 30 }]);
  tell("told", { reply: { kind: "Resynchronised" } });
  expect(measured.alarms).toEqual([]);
  tell("welcome", { life: "b" });
  expect([measured.last, measured.body]).toEqual([undefined, null]);
});

test("a measured arm at rest has nothing drawn; one that moves does, five times a second at most", () => {
  vi.useFakeTimers({ toFake: ["setTimeout"] });
  const listeners: [string | string[], (message: Message) => void][] = [];
  const connection = { state: "open", welcome: { life: "a" }, on: (topic: string, f: (message: Message) => void) => listeners.push([topic, f]) };
  let drawings = 0;
  new LiveSource(connection as unknown as Connection).onChange(() => drawings++);
  const reported = (first: number, q: number): number => {
    for (const [topic, f] of listeners) if (topic === "measurements") f({ first, times: [first / 100], joints: [[q]] });
    vi.advanceTimersByTime(10);
    return drawings;
  };
  for (let i = 0; i < 100; i++) reported(i, 1 + 4e-5 * (i % 3));
  expect(drawings, "the first one alone").toBe(1);
  for (let i = 100; i < 200; i++) reported(i, 1 + 0.001 * (i - 100));
  expect(drawings).toBeGreaterThan(4);
  expect(drawings).toBeLessThan(7);
  vi.useRealTimers();
});

test("a report is compared with the timeline at its own time", () => {
  const model = { joints: [{ a: 1, d: 0, alpha: 0, lower: -3, upper: 3 }] } as unknown as Model;
  const timeline = new Timeline();
  timeline.replace({ version: 1, segments: [{ start: 0, finish: 10, phase: "cruise", joints: [[0, 0.1]], motion: { number: 1, kind: "Go" } }] });
  const { joints, distance, angle } = residualOf(model, timeline, { t: 5, q: [0.7] });
  expect(joints[0]).toBeCloseTo(0.2, 12);
  expect(distance).toBeCloseTo(2 * Math.sin(0.1), 12);
  expect(angle).toBeCloseTo(0.2, 12);
});

test("the way to the server is the longest that was seen, and a line is in time by what is left after it", () => {
  const clock = new ServerClock();
  clock.heard(0, 100.1, 100.1, 0.2);
  expect(clock.forward).toBeCloseTo(0.1, 12);
  clock.heard(1, 101.5, 101.5, 1.6);
  expect(clock.forward).toBeCloseTo(0.5, 12);
  expect(leadNote("MOVE a AT 12.5", 10, 10.52, false)).toBe("in time: 2.0 s to spare beyond D_f");
  expect(leadNote("DRIVE 1, 5 at 10", 10, 10.52, false)).toBe("too late by 0.5 s: the earliest now is AT 10.6");
  expect(leadNote("DRIVE 1, 5 IN .2", 10, 10.52, true)).toBe("too late by 0.3 s: the earliest now is IN 0.6");
  for (const line of ["DRIVE 1, 5 IN .2", "WHERE AT 3", "MOVE a", "MOVE AT"]) expect(leadNote(line, 10, 10.5, false)).toBe("");
});

test("the body, its reports and an alarm in words", () => {
  expect(bodyOf({ name: "arm", mode: "stopped" })).toBe("arm stopped, is to follow");
  expect(bodyOf({ name: "arm", mode: "holds", order: "holds" })).toBe("arm holds");
  expect(bodyOf({ name: "" })).toBe("nobody is the body now");
  const counts = { received: 900, lost: 2, reordered: 1 };
  expect(countsOf({ counts, rate: 99.7, delay: 0.21, offset: -0.004 })).toBe(
    "900 reports, 100 a second, 2 lost, 1 reordered, 210 ms old on arrival, its clock is 4 ms behind");
  expect(alarmOf({ t: 3, joint: 2, cause: "payload", detail: "2.0 kg more." })).toBe("3.00 s, JT2: likely cause: payload; 2.0 kg more.");
});
