import { expect, test, vi } from "vitest";
import { Change } from "../src/core/change";
import { ServerClock } from "../src/core/connection";
import { rememberedValue } from "../src/core/storage";

test("what is drawn is drawn anew where its key is another one", () => {
  const change = new Change();
  expect([change.to("a"), change.to("a"), change.to([1, null]), change.to([1, null]), change.to([2, null])]).toEqual([true, false, true, false, true]);
  change.forget();
  expect(change.to([2, null])).toBe(true);
});

test("a change that comes too early waits, and wakes the page once, when its time is there", () => {
  vi.useFakeTimers({ toFake: ["performance", "setTimeout"] });
  let woken = 0;
  const change = new Change(100, () => woken++);
  expect(change.to("a")).toBe(true);
  expect([change.to("b"), change.to("c"), woken]).toEqual([false, false, 0]);
  expect([change.to("a"), woken], "it is drawn already").toEqual([false, 0]);
  vi.advanceTimersByTime(99);
  expect(woken).toBe(0);
  vi.advanceTimersByTime(1);
  expect([change.to("b"), woken]).toEqual([true, 1]);
  vi.useRealTimers();
});

test("the exchange with the shortest trip tells the server's clock, until a clock is set", () => {
  const clock = new ServerClock();
  clock.guess(10, 1010.5);
  expect([clock.there(10), clock.trip]).toEqual([1010.5, Infinity]);
  clock.heard(10, 1010.3, 1010.3, 10.4); // 0.3 s there, 0.1 s back
  expect(clock.there(20)).toBeCloseTo(1020.1, 9);
  clock.heard(12, 1012.01, 1012.02, 12.03);
  expect([clock.there(20), clock.trip].map((x) => Math.round(1e6 * x))).toEqual([1020e6, 20_000]);
  clock.heard(14, 1014.2, 1014.2, 14.9);
  expect(clock.there(20), "a longer trip tells less").toBeCloseTo(1020, 9);
  clock.heard(16, 516.01, 516.01, 16.02);
  expect(clock.there(20)).toBeCloseTo(520, 9);
  for (let t = 18; t < 100; t += 2) clock.heard(t, t + 500.05, t + 500.05, t + 0.1);
  expect(clock.trip, "what is old counts no more").toBeCloseTo(0.1, 9);
});

test("what is remembered and is no JSON is taken as nothing", () => {
  const holds = (text: string | null) => () => ({ getItem: () => text }) as unknown as Storage;
  expect(rememberedValue("x", [], holds('["a"]'))).toEqual(["a"]);
  for (const text of ["{", null, "null"]) expect(rememberedValue("x", [1], holds(text))).toEqual([1]);
  expect(rememberedValue("x", [1], () => { throw new Error("no storage"); })).toEqual([1]);
});
