import type { Connection, Message } from "./connection";
import { type Model, g, toolFrame } from "./kinematics";
import { type Timeline, countUntil } from "./timeline";
import { angleBetween, originOf } from "./transform";

const GAP = 0.5; // [s] between reports that are farther apart the joints are unknown, as in vrs itself
const FINEST = 0.004; // [s] minimum distance of stored reports; others are dropped
const STRETCH = 20; // [s] length of one requested stretch
const MAX_REPORTS = 80_000; // maximum; with more, all are dropped and requested again when needed
const MAX_ALARMS = 20;

/** Joints that a body measured at t [rad, m], and their velocities if it reported them [rad/s, m/s]. */
export interface Report {
  t: number;
  q: number[];
  v?: number[];
}

/** How far a measured arm is from the timeline at the time of the report: each joint [rad, m], the tool [m, rad]. */
export interface Residual {
  joints: number[];
  distance: number;
  angle: number;
}

/** The known reports of the robot's body: new ones as they arrive, and stretches of the past, which are requested when
 * they are displayed. */
export class Measured {
  /** The body and its state; null for none. */
  body: Message | null = null;
  /** The time of the last report before a gap [s]; null while reports arrive. */
  unknown: number | null = null;
  /** The last alarms since RESYNC, the newest last. */
  alarms: Message[] = [];
  private reports: Report[] = []; // in order of time
  private asked = new Set<number>(); // stretches of the past, by number
  private next: number | null = null; // number of the next report
  private life: string | undefined;

  constructor(private readonly connection: Connection) {
    this.life = connection.welcome?.life;
    connection.on("welcome", ({ life }) => this.begin(life));
    connection.on("bodystatus", ({ body = null, unknown = null }) => Object.assign(this, { body, unknown }));
    connection.on("alarm", ({ alarm }) => this.alarms.push(alarm) > MAX_ALARMS && this.alarms.shift());
    connection.on("told", ({ reply }) => reply?.kind === "Resynchronised" && (this.alarms = []));
    connection.on("measurements", (message) => {
      if (this.next !== message.first) this.asked.clear(); // some reports are missing
      this.next = message.first + message.times.length;
      this.put(reportsOf(message));
    });
  }

  private begin(life: string): void {
    this.next = null;
    this.asked.clear();
    if (life !== this.life) Object.assign(this, { life, reports: [], alarms: [], body: null, unknown: null });
  }

  /** The newest report; undefined if none is known. */
  get last(): Report | undefined {
    return this.reports[this.reports.length - 1];
  }

  /** Returns the measured arm at t; null if it is unknown. Then it requests the reports around t. */
  at(t: number): Report | null {
    this.recall(Math.floor(t / STRETCH));
    return between(this.reports, t);
  }

  private recall(stretch: number): void {
    if (stretch < 0 || this.asked.has(stretch) || !(this.body || this.last) || this.connection.state !== "open") return;
    this.asked.add(stretch);
    void this.fetch(stretch * STRETCH - GAP, (stretch + 1) * STRETCH + GAP);
  }

  private async fetch(begin: number, end: number): Promise<void> {
    const { parts = [], goes_on } = await this.connection.ask("measuredwindow", { begin: Math.max(begin, 0), end });
    const found: Report[] = (parts as Message[]).flatMap(reportsOf);
    this.put(found);
    if (goes_on && found.length) await this.fetch(found[found.length - 1].t + 1e-9, end);
  }

  /** Puts reports in their places. */
  private put(found: Report[]): void {
    if (!found.length) return;
    const sorted = found[0].t > (this.last?.t ?? -Infinity);
    const all = sorted ? this.reports : [...this.reports, ...found].sort((a, b) => a.t - b.t);
    if (sorted) for (const one of found) if (one.t >= (this.last?.t ?? -Infinity) + FINEST) all.push(one);
    this.reports = sorted ? all : all.filter(({ t }, i) => i === 0 || t > all[i - 1].t);
    if (this.reports.length < MAX_REPORTS) return;
    this.reports.splice(0, this.reports.length - 1);
    this.asked.clear();
  }
}

function reportsOf({ times, joints, velocity }: Message): Report[] {
  return (times as number[]).map((t, i) => ({ t, q: joints[i], v: velocity?.[i] }));
}

/** Returns the arm at t between two reports, which are in order of time: by cubic polynomials where both have velocities,
 * else by straight lines; null where it is unknown. */
export function between(reports: Report[], t: number): Report | null {
  const i = countUntil(reports, t, (report) => report.t) - 1;
  const [a, b] = [reports[i], reports[i + 1]];
  if (!a || a.t === t) return a ?? null;
  const h = b ? b.t - a.t : Infinity;
  if (h > GAP) return null;
  const u = (t - a.t) / h;
  const q = a.q.map((x, k) => {
    const step = b.q[k] - x;
    if (!a.v || !b.v) return x + u * step;
    const [va, vb] = [h * a.v[k], h * b.v[k]];
    return x + u * (va + u * (3 * step - 2 * va - vb + u * (va + vb - 2 * step)));
  });
  return { t, q };
}

/** Compares a report with the timeline at its own time. */
export function residualOf(model: Model, timeline: Timeline, { t, q }: Report): Residual {
  const planned = g(model, timeline, t);
  const [there, here] = [q, planned].map((joints) => toolFrame(model, joints, timeline.tool(t)));
  const [a, b] = [originOf(there), originOf(here)];
  return { joints: q.map((x, i) => x - planned[i]), distance: Math.hypot(...a.map((x, i) => x - b[i])), angle: angleBetween(there, here) };
}
