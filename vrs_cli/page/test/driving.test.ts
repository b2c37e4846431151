import { expect, test, vi } from "vitest";
import type { Connection, Message } from "../src/core/connection";
import type { Model } from "../src/core/kinematics";
import { merged, Survey } from "../src/core/survey";
import { heldText } from "../src/panels/drag";
import { scan } from "../src/panels/language";
import { suggestions } from "../src/panels/prompt";

const inks = (line: string): string[] => scan(line).filter(([text]) => text.trim()).map(([text, ink]) => `${text}:${ink}`);

test("words have the ink of their table, and a line is its runs", () => {
  expect(inks("MOVES part:a, 50 ; go")).toEqual(["MOVES:instruction", "part:name", "::operator", "a:name", ",:operator", "50:number", "; go:comment"]);
  expect(inks('TYPE "a;b", SIN(x)')).toEqual(["TYPE:instruction", '"a;b":string', ",:operator", "SIN:function", "(:operator", "x:name", "):operator"]);
  expect(inks("FOR i = 1 TO n")).toEqual(["FOR:control", "i:name", "=:operator", "1:number", "TO:control", "n:name"]);
  expect(inks("move = 4")[0]).toBe("move:name");
  expect(inks("SIGNA 1")[0]).toBe("SIGNA:command");
  for (const line of ["", "   ", "\u0000\ud83e\udd16 <img>", '"', ".PROGRAM a()", "x".repeat(5000)]) expect(scan(line).map(([text]) => text).join("")).toBe(line);
});

test("what holds the tool is said in the units of its joint", () => {
  const model: Model = { name: "", title: "", poses: {}, joints: [{ a: 0, d: 0, alpha: 0, lower: -Math.PI, upper: 1 }, { a: 0, d: 0, alpha: 0, lower: 0, upper: 0.25, kind: "prismatic" }] };
  const held = (...holds: Message[]): Message => ({ away: 0.0123, holds });
  expect(heldText(held({ limit: "joint", joint: 1, end: "lower" }), model)).toBe("JT1 is at its lower limit, -180.0 deg (12 mm away)");
  expect(heldText(held({ limit: "joint", joint: 2, end: "upper" }), model)).toBe("JT2 is at its upper limit, 250.0 mm (12 mm away)");
  expect(heldText(held({ limit: "reach", which: "far" }, { limit: "speed", joint: 2 }), model)).toBe("out of reach: too far; JT2 is as fast as it may be (12 mm away)");
  expect(heldText(undefined, model)).toBe("");
});

test("lists that are left out stay as they are known", () => {
  const before = merged(null, { marks: ["a", "b", "c"], places: 1, programs: 2 });
  expect(merged(before, { marks: ["a", "b", "c"], places: null, programs: null })).toMatchObject({ places: 1, programs: 2 });
  expect(merged(before, { marks: ["a", "x", ""], places: null, programs: 4 })).toMatchObject({ places: 1, programs: 4 });
});

test("a survey is asked at most five times a second, and again while a program runs", async () => {
  vi.useFakeTimers();
  const heard: Record<string, () => void> = {};
  const asked: Message[] = [];
  let task: Message | undefined;
  const connection = {
    state: "open",
    on: (topics: string | string[], hear: () => void) => {
      for (const topic of [topics].flat()) heard[topic] = hear;
      return () => {};
    },
    ask: async (_type: string, { act }: Message) => {
      asked.push(act);
      return { found: { kind: "Surveyed", marks: ["a", "b", act.program ? "c" : ""], tasks: task ? [task] : [] } };
    },
  };
  const survey = new Survey(connection as unknown as Connection, () => {});
  await vi.advanceTimersByTimeAsync(50);
  for (let i = 0; i < 100; i++) {
    heard.told();
    await vi.advanceTimersByTimeAsync(10);
  }
  expect(asked.length).toBeGreaterThan(3);
  expect(asked.length).toBeLessThanOrEqual(7);
  await vi.advanceTimersByTimeAsync(1000);
  const rest = asked.length;
  await vi.advanceTimersByTimeAsync(5000);
  expect(asked.length).toBe(rest);
  task = { program: "demo", running: true, step: 250 };
  heard.activity();
  await vi.advanceTimersByTimeAsync(1100);
  expect(asked.length).toBeGreaterThan(rest + 3);
  expect(asked[asked.length - 1]).toMatchObject({ program: "demo", known: ["a", "b", "c"] });
  expect(survey.task).toBe(task);
  vi.useRealTimers();
});

test("suggestions replace what is begun, each once", () => {
  const found = suggestions([{ text: "MOVE", length: 3, meta: "MOVE place: go" }, { text: "MOVE", length: 3 }, { text: "MOVES", length: 3 }], 10)!;
  expect(found.from).toBe(7);
  expect(found.options.map((one) => one.label)).toEqual(["MOVE", "MOVES"]);
  expect(suggestions([], 0)).toBeNull();
});
