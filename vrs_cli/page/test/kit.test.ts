import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, inject, test } from "vitest";
import { Connection, type Message, type Socket } from "../src/core/connection";
import { g, toolFrame } from "../src/core/kinematics";
import { multiply } from "../src/core/transform";

const folder = inject("recordings");
/** What this client leaves to the server: it says `full`, JSON, and computes lines itself. */
const NOT_NEEDED = ["msgpack", "lspb", "scurve"];

class FakeSocket implements Socket {
  readyState: 0 | 1 | 2 | 3 = 0;
  sent: Message[] = [];
  onopen: Socket["onopen"] = null;
  onmessage: Socket["onmessage"] = null;
  onclose: Socket["onclose"] = null;
  send(data: string): void {
    this.sent.push(JSON.parse(data));
  }
  close(): void {
    this.readyState = 3;
    this.onclose?.call(this as unknown as WebSocket, {} as CloseEvent);
  }
}

/** Drives a connection through the steps of a conversation (docs/protocol.md, `python -m tests.net.kit`). */
class Run {
  readonly ids = new Map<string, number>();
  readonly ends = new Map<string, string>();
  hello: Message = {};
  socket!: FakeSocket;
  connection!: Connection;

  step(step: Message): void {
    if (step.open) this.open(step.open);
    else if (step.sent) this.checkSent(step.sent);
    else if (step.received) this.socket.onmessage!.call(this.socket as unknown as WebSocket, { data: this.filled(step.received) } as MessageEvent);
    else if (step.cut) this.socket.close();
    else if (step.do) this.act(step.do, step.as);
    else this.check(step);
  }

  private open(fields: Message): void {
    Object.keys(this.hello).forEach((key) => delete this.hello[key]);
    Object.assign(this.hello, fields);
    const connect = (): FakeSocket => (this.socket = new FakeSocket());
    if (this.connection) this.connection.reopen();
    else this.connection = new Connection("ws://kit", "", "ada", { hello: this.hello, follow: null, connect, wall: () => 0 });
    this.socket.readyState = 1;
    this.socket.onopen!.call(this.socket as unknown as WebSocket, {} as Event);
  }

  private filled(message: Message): string {
    return JSON.stringify(message, (_, value) => (typeof value === "string" && value.startsWith("$") ? (this.ids.get(value.slice(1)) ?? value) : value));
  }

  private checkSent(pattern: Message): void {
    while (this.socket.sent[0]?.type === "ping") this.socket.sent.shift();
    const sent = this.socket.sent.shift();
    const id = pattern.id?.slice?.(1);
    if (id && !this.ids.has(id)) this.ids.set(id, sent?.id);
    expect(sent).toMatchObject(JSON.parse(this.filled(pattern)));
  }

  private act(message: Message, as?: string): void {
    const { type, ...fields } = message;
    if (!as) return void this.connection.send(message);
    const answer = type === "subscribe" ? this.connection.follow(fields) : type === "window" ? this.recall(fields) : this.connection.ask(type, fields);
    void answer.then((end) => this.ends.set(as, end.type === "refused" || end.ok === false ? "refused" : end.type));
  }

  private recall(fields: Message): Promise<Message> {
    return this.connection.recall(fields.begin).then((more) => ({ type: more ? "shown" : "refused" }));
  }

  private check(step: Message): void {
    const { timeline, welcome } = this.connection;
    if (step.joints) {
      const { times, joints, within } = step.joints;
      times.forEach((t: number, i: number) => {
        const found = g(welcome!.model, timeline, t);
        const line = timeline.locate(t)[0].line;
        found.forEach((x, j) => {
          if (line) expect(Math.abs(x - joints[i][j]), `joint ${j + 1} at ${t}: ${x}, ${joints[i][j]}`).toBeLessThanOrEqual(Math.max(within, 1e-9));
          else expect(x, `joint ${j + 1} at ${t}`).toBe(joints[i][j]);
        });
      });
    } else if (step.tools) {
      step.tools.times.forEach((t: number, i: number) => {
        const T_robot_tool = toolFrame(welcome!.model, g(welcome!.model, timeline, t), timeline.tool(t));
        const T = multiply(timeline.base(t), T_robot_tool);
        T.forEach((x, k) => expect(Math.abs(x - step.tools.tools[i][k])).toBeLessThanOrEqual(Math.max(step.tools.within, 1e-9)));
      });
    } else if (step.values) {
      const { channel, times, values } = step.values;
      expect(times.map((t: number) => timeline.lastEvent(channel, t)?.value ?? 0)).toEqual(values);
    } else if (step.ends) {
      for (const [name, end] of Object.entries(step.ends)) expect(this.ends.get(name) ?? null, name).toBe(end);
    } else if (step.now) {
      const { walls, now, within } = step.now;
      walls.forEach((wall: number, i: number) => expect(Math.abs(this.connection.robotAt(wall) - now[i])).toBeLessThanOrEqual(within ?? 1e-9));
    } else if (step.asked) {
      expect([...this.connection.questions.keys()].sort()).toEqual(step.asked);
    } else throw new Error(`an unknown step: ${Object.keys(step)}`);
  }
}

const conversations = readdirSync(folder).map((name) => JSON.parse(readFileSync(join(folder, name), "utf8")));

describe("the conformance kit", () => {
  const own = conversations.filter(({ needs }) => !needs.some((need: string) => NOT_NEEDED.includes(need)));
  test("has lines of every kind of arm", () => expect(own.length).toBeGreaterThan(18));
  test.each(own.map((one) => [one.name, one]))("%s", async (_, { steps }) => {
    const run = new Run();
    for (const step of steps) {
      run.step(step);
      await new Promise((done) => setImmediate(done)); // promises are kept
    }
  });
});
