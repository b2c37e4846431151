import type { Message } from "./connection";
import { countUntil } from "./timeline";
import { multiply, type Transform } from "./transform";

const GRAVITY = 9.81; // [m/s2]

/** A row of a track: its time [s], and the state until the next row. */
type Row = [number, ...unknown[]];
/** The state of a part: `rests` at T_world_part, `held` at T_flange_part, `falls` from T_world_part, or `absent`. */
type PartRow = [number, "rests" | "held" | "falls" | "absent", number[], string[]];
/** The part in the hand, and how far the fingers are open. */
type GripRow = [number, string | null, number];
/** A sensor is on or off. */
type SwitchRow = [number, boolean];
/** Two bodies touch from one time to another [s]; null: for ever. */
export type ContactSpan = [number, number | null, string, string];

/** A course in a message `course` or a saved trajectory (docs/protocol.md). */
export interface CourseRows {
  parts?: Record<string, PartRow[]>;
  grips?: GripRow[];
  sensors?: Record<string, SwitchRow[]>;
  notes?: [number, string, string][];
}

/** The state of the cell over time, from the server: parts, the hand, signals, sensors, contacts. */
export class World {
  /** Number of received messages; drawings of an older number are out of date. */
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

  /** Receives a message `course` or `contacts`. */
  hear(message: Message): void {
    this.version++;
    if (message.type === "contacts") return this.hearContacts(message.touches, message.since, message.until ?? Infinity);
    const since: number = message.since ?? -Infinity;
    for (const [key, rows] of this.tracks) this.tracks.set(key, rows.filter((row) => row[0] < since));
    const { parts = {}, grips = [], sensors = {}, notes = [] }: CourseRows = message.rows;
    for (const [kind, several] of Object.entries({ part: parts, sensor: sensors, grips: { "": grips }, notes: { "": notes } }))
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

  /** Returns T_world_part at t; null for an absent part. `T_world_flange`: of the arm at t. */
  pose(name: string, t: number, T_world_flange: Transform): Transform | null {
    const [begin, does, numbers] = this.row<PartRow>(`part ${name}`, t) ?? [0, "absent", []];
    if (does === "absent") return null;
    const T = Float64Array.from(numbers);
    if (does === "held") return multiply(T_world_flange, T);
    if (does === "falls") T[11] -= 0.5 * GRAVITY * (t - begin) ** 2;
    return T;
  }

  /** Returns the bodies that a part stands on at t. */
  supports(name: string, t: number): string[] {
    const row = this.row<PartRow>(`part ${name}`, t);
    return row?.[1] === "rests" ? row[3] : [];
  }

  /** Returns the part in the hand at t. */
  held(t: number): string | null {
    return this.row<GripRow>("grips ", t)?.[1] ?? null;
  }

  /** Returns how far the resting fingers are open at t: 1 open, 0 closed. They stop at a part that they grip. */
  opening(t: number): number | undefined {
    return this.row<GripRow>("grips ", t)?.[2];
  }

  /** Returns whether something is in the region of a sensor, by its number in the scene. */
  sees(sensor: number, t: number): boolean {
    return this.row<SwitchRow>(`sensor ${sensor}`, t)?.[1] ?? false;
  }

  /** Returns the pairs of bodies that touch within half of `lasting` [s] of t. */
  touching(t: number, lasting = 0): [string, string][] {
    const half = 0.5 * lasting;
    return this.touches.filter(([begin, end]) => begin <= t + half && (end ?? Infinity) >= t - half).map(([, , a, b]) => [a, b]);
  }

  /** Returns the last row of a track that begins at t or before. */
  private row<R extends Row>(key: string, t: number): R | undefined {
    const rows = (this.tracks.get(key) ?? []) as R[];
    return rows[countUntil(rows, t, ([time]) => time) - 1];
  }
}
