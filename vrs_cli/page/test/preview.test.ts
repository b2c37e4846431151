import { expect, test } from "vitest";
import type { Connection, Message } from "../src/core/connection";
import { Preview } from "../src/core/preview";
import { LiveSource } from "../src/core/source";
import { Timeline } from "../src/core/timeline";
import { notes } from "../src/panels/delays";

const motion = { number: 1, kind: "Begin" };
const rest = (start: number, finish: number, at: number) => ({ start, finish, phase: "hold", joints: [[at]] });

/** A connection to a robot in real time, whose clock and messages are what a test says. */
class FakeConnection {
  timeline = new Timeline();
  passes = true;
  state = "open";
  clock = 10;
  sent: Message[] = [];
  private heard = new Map<string, ((message: Message) => void)[]>();

  constructor() {
    this.timeline.replace({ version: 3, segments: [{ ...rest(0, 5, 0), motion }] }, 7);
  }
  on(topics: string | string[], listener: (message: Message) => void): () => void {
    for (const topic of [topics].flat()) this.heard.set(topic, [...(this.heard.get(topic) ?? []), listener]);
    return () => {};
  }
  tell(topic: string, message: Message = {}): void {
    for (const listener of this.heard.get(topic) ?? []) listener(message);
  }
  become(state: string): void {
    this.state = state;
    this.tell("state");
  }
  now(): number {
    return this.clock;
  }
  send(message: Message): boolean {
    this.sent.push(message);
    return this.state === "open";
  }
}

function looking(): [FakeConnection, LiveSource, Preview] {
  const connection = new FakeConnection();
  const source = new LiveSource(connection as unknown as Connection);
  return [connection, source, source.preview];
}

const delta = { version: 3, motion: { number: 2 ** 40 + 1, kind: "Move" }, cut: 5, keep: 1, drop: 0, segments: [rest(12, 13, 1)] };

test("the predicted timeline is the known one after the deltas, and the known one stays", () => {
  const [connection, source] = looking();
  expect(source.timeline).toBe(connection.timeline);
  connection.tell("preview", { number: 7, deltas: [delta, { ...delta, version: 4, keep: 2, cut: 13, segments: [rest(13, 15, 2)] }] });
  expect(source.timeline.segments.map((s) => s.finish)).toEqual([5, 13, 15]);
  expect(source.timeline.segments[2].motion.number).toBe(2 ** 40 + 1);
  expect(connection.timeline.segments.length).toBe(1);
  connection.tell("preview", { number: 8, deltas: [delta] });
  expect(source.timeline, "it is of another version of the known one").toBe(connection.timeline);
});

test("the followed time is what is heard, where the robot is predicted", () => {
  const [connection, source, preview] = looking();
  connection.tell("preview", { number: 7, round_trip: 0.5 });
  expect([source.now(), preview.shown(10), preview.heard(10)]).toEqual([10, 10, 9.75]);
  connection.tell("preview", { number: 7, round_trip: 0.5, ahead: "auto" });
  expect([source.now(), preview.shown(10)]).toEqual([9.75, 10.25]);
  connection.tell("preview", { number: 7, round_trip: 0.5, ahead: 1 });
  expect(preview.shown(10)).toBe(10.75);
  preview.choose("present");
  expect([connection.sent, source.now()]).toEqual([[{ type: "ahead", ahead: "present" }], 10]);
});

test("in virtual time nothing is predicted", () => {
  const [connection, source, preview] = looking();
  connection.passes = false;
  connection.tell("preview", { number: 7, ahead: "auto" });
  expect([preview.predicts, source.now(), preview.shown(10)]).toEqual([false, 10, 10]);
});

test("after a cut nothing later than the last that was heard is confirmed, until the connection is back", () => {
  const [connection, , preview] = looking();
  connection.tell("preview", { number: 7, round_trip: 0.5 });
  expect(preview.unconfirmed(10)).toBe(Infinity);
  connection.become("cut");
  connection.clock = 12;
  connection.become("opening");
  connection.become("cut");
  expect([preview.heard(12), preview.unconfirmed(12)]).toEqual([9.75, 9.75]);
  expect(preview.doubt(12)).toBe("unconfirmed from 9.750 s on: the robot is not heard");
  connection.become("open");
  expect([preview.heard(12), preview.unconfirmed(12)]).toEqual([11.75, Infinity]);
});

test("the notes say what is on its way, what will be refused and what was wrong", () => {
  const [connection, , preview] = looking();
  const expected = [
    { id: 4, text: "MOVE <a>", issued: 10, begin: 10.5 },
    { id: 5, text: "MOVE far", issued: 10, refused: "*Location out of range*" },
  ];
  connection.tell("preview", { number: 7, round_trip: 0.3, ahead: "auto", expected, flagged: [[2, 3], [8.5, 9]] });
  expect(notes(preview, 10, 10)).toEqual([
    ["", "D_f + D_b: 300 ms"],
    ["", "heard: 9.85 s"],
    ["predicted", "predicted: 10.15 s"],
    ["flagged", "flagged: 8.500 to 9.000 s was shown before a command changed it"],
    ["unconfirmed", "unconfirmed from 10.500 s on: MOVE <a>, MOVE far"],
    ["refused", "MOVE far will be refused: *Location out of range*"],
  ]);
  expect(preview.flag(7), "no longer of interest").toBe("");
  connection.tell("preview", { number: 7, since_heard: true });
  expect(preview.doubt(10)).toBe("unconfirmed from 10.000 s on: DRAG");
});

test("a command that is refused stays marked when it is expected no more", () => {
  const [connection, , preview] = looking();
  const late = { id: 3, text: "DRIVE 1, 30 AT 9", issued: 9.5, refused: "it is too late" };
  connection.tell("preview", { number: 7, expected: [{ id: 2, text: "WHERE", issued: 9 }, late] });
  connection.tell("preview", { number: 8, expected: [late] });
  connection.tell("preview", { number: 9 });
  expect(preview.expected).toEqual([]);
  expect(preview.late).toEqual([late]);
});
