import type { Message } from "./connection";
import type { EventRecord } from "./timeline";
import { multiply, type Transform } from "./transform";

const GRAVITY = 9.81; // [m/s2]

/** A row of a track: its time [s], and what holds from then on until the next row. */
type Row = [number, ...unknown[]];
/** What a part does: `rests` at T_world_part, `held` at T_flange_part, `falls` from T_world_part, or is `absent`. */
type PartRow = [number, "rests" | "held" | "falls" | "absent", number[], string[]];
/** The part in the hand, and how far the fingers are open. */
type GripRow = [number, string | null, number];
/** Two bodies touch from one time to another [s]; null: for ever. */
export type ContactSpan = [number, number | null, string, string];

/** A course as `course` and a saved trajectory tell it (docs/protocol.md). */
export interface CourseRows {
  parts?: Record<string, PartRow[]>;
  grips?: GripRow[];
  signals?: Record<string, [number, boolean][]>;
  sensors?: Record<string, [number, boolean][]>;
  notes?: [number, string, string][];
}

/** Returns the last row that begins at t or before. */
function rowAt<R extends Row>(rows: R[] | undefined, t: number): R | undefined {
  let low = 0;
  let high = rows?.length ?? 0;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows![middle][0] <= t) low = middle + 1;
    else high = middle;
  }
  return rows?.[low - 1];
}

/** What is around the robot at any time, as the server tells it: parts, the hand, signals, sensors, contacts. */
export class World {
  /** Counts what was heard: what is drawn of an older count is out of date. */
  version = 0;
  /** The course is known before this time [s]. */
  until = -Infinity;
  private tracks = new Map<string, Row[]>();
  private touches: ContactSpan[] = [];

  /** Forgets all. */
  clear(): void {
    [this.until, this.tracks, this.touches] = [-Infinity, new Map(), []];
    this.version++;
  }

  /** Returns the world of a saved trajectory. */
  static of(rows: CourseRows, touches: ContactSpan[] | null, until: number | null): World {
    const world = new World();
    world.hear({ type: "course", rows, until });
    if (touches) world.hear({ type: "contacts", touches, since: -Infinity });
    return world;
  }

  /** Takes a message `course` or `contacts`. */
  hear(message: Message): void {
    this.version++;
    if (message.type === "contacts") return this.hearContacts(message.touches, message.since, message.until ?? Infinity);
    const since: number = message.since ?? -Infinity;
    for (const [key, rows] of this.tracks) this.tracks.set(key, rows.filter((row) => row[0] < since));
    const { parts = {}, grips = [], signals = {}, sensors = {}, notes = [] }: CourseRows = message.rows;
    for (const [kind, several] of Object.entries({ part: parts, signal: signals, sensor: sensors, grips: { "": grips }, notes: { "": notes } }))
      for (const [name, rows] of Object.entries<Row[]>(several)) {
        const key = `${kind} ${name}`;
        this.tracks.set(key, [...(this.tracks.get(key) ?? []), ...rows]);
      }
    this.until = message.until ?? Infinity;
  }

  private hearContacts(touches: ContactSpan[], since: number, until: number): void {
    const kept = this.touches.flatMap(([begin, end, a, b]): ContactSpan[] => {
      const last = end ?? Infinity;
      const before: ContactSpan[] = begin < since ? [[begin, Math.min(last, since), a, b]] : [];
      return last > until ? [...before, [Math.max(begin, until), end, a, b]] : before;
    });
    this.touches = [...kept, ...touches].sort((a, b) => a[0] - b[0]);
  }

  /** Returns T_world_part at t, null for a part that is not there. `T_world_flange`: where the arm is then. */
  pose(name: string, t: number, T_world_flange: Transform): Transform | null {
    const row = rowAt(this.tracks.get(`part ${name}`) as PartRow[] | undefined, t);
    if (!row || row[1] === "absent") return null;
    const T = Float64Array.from(row[2]);
    if (row[1] === "held") return multiply(T_world_flange, T);
    if (row[1] === "falls") T[11] -= 0.5 * GRAVITY * (t - row[0]) ** 2;
    return T;
  }

  /** Returns the bodies that a part stands on at t. */
  supports(name: string, t: number): string[] {
    const row = rowAt(this.tracks.get(`part ${name}`) as PartRow[] | undefined, t);
    return row?.[1] === "rests" ? row[3] : [];
  }

  /** Returns the part in the hand at t. */
  held(t: number): string | null {
    return this.grip(t)?.[1] ?? null;
  }

  /** Whether something is in the region of a sensor, by its number in the scene. */
  sees(sensor: number, t: number): boolean {
    return this.isOn(`sensor ${sensor}`, t);
  }

  /** Whether an input that the world drives is on. */
  signal(number: number, t: number): boolean {
    return this.isOn(`signal ${number}`, t);
  }

  /** Returns what there is to tell of a stretch of time: what fell, what the hand missed. */
  notes(begin: number, end: number): string[] {
    return (this.tracks.get("notes ") ?? []).filter(([t]) => t > begin && t <= end).map((row) => row[2] as string);
  }

  /** Returns the pairs of bodies that touch within half of `lasting` [s] of t. */
  touching(t: number, lasting = 0): [string, string][] {
    const half = 0.5 * lasting;
    return this.touches.filter(([begin, end]) => begin <= t + half && (end ?? Infinity) >= t - half).map(([, , a, b]) => [a, b]);
  }

  /** Returns how far the fingers are open at t, 1 open, 0 closed. `last`: the last event of the hand until then. They stop at a part that they take. */
  fingers(t: number, last: EventRecord | undefined): number {
    const share = last?.duration ? (t - last.time) / last.duration : 1;
    if (!last || share >= 1) return this.grip(t)?.[2] ?? 0;
    const before = this.grip(last.time - 1e-9)?.[2] ?? 0;
    return before + share * ((this.grip(last.time + last.duration!)?.[2] ?? last.value) - before);
  }

  private grip(t: number): GripRow | undefined {
    return rowAt(this.tracks.get("grips ") as GripRow[] | undefined, t);
  }

  private isOn(key: string, t: number): boolean {
    return rowAt(this.tracks.get(key) as [number, boolean][] | undefined, t)?.[1] ?? false;
  }
}
