import type { Connection, Message } from "./connection";
import type { DeltaRecord, Timeline } from "./timeline";

/** How far ahead of what is heard the robot is shown: at its present, where a command of now finds it, or so much [s]. */
export type Ahead = "present" | "auto" | number;

/** A command on its way, and what it will do; the field names of the wire. Without `begin` it changes nothing. */
export interface Expected {
  id: number;
  text: string;
  issued: number;
  begin?: number;
  refused?: string;
  planned?: boolean;
}

/** A span of time [s]. */
export type Span = [begin: number, end: number];

/** [s] for which a note about a span stays after its end. */
const FRESH = 3;
const MAX_LATE = 20; // commands that are remembered

/**
 * What is expected of a robot that is served. Of one behind a line with delays `vrs view` computes it, and tells it by
 * the message `preview`; without such a message nothing is known but that a connection is cut.
 * D_f is the delay of a command, D_b that of an answer; times are those of the robot's clock [s].
 */
export class Preview {
  expected: Expected[] = [];
  flagged: Span[] = [];
  /** Commands that the robot will not do, or has not done: the last ones. */
  readonly late: Expected[] = [];
  /** D_f + D_b, in seconds of the robot. */
  roundTrip = 0;
  ahead: Ahead = "present";
  /** Whether the delays are too short to matter; so it is where nobody tells of them. */
  near = true;
  private own: Timeline | null = null;
  private sinceHeard = false;
  private cutAt = Infinity;

  constructor(private readonly connection: Connection) {
    connection.on("preview", (message) => this.take(message));
    connection.on("state", () => {
      this.cutAt = connection.state === "open" ? Infinity : Math.min(this.cutAt, connection.now());
    });
  }

  private take(message: Message): void {
    const known = this.connection.timeline;
    const deltas: DeltaRecord[] = message.deltas ?? [];
    this.own = null;
    if (deltas.length && message.number === known.number) {
      const predicted = known.copy();
      if (deltas.every((delta) => predicted.apply(delta, predicted.number + 1))) this.own = predicted;
    }
    this.expected = message.expected ?? [];
    for (const one of this.expected) if (one.refused !== undefined && !this.late.some(({ id }) => id === one.id)) this.late.push(one);
    this.late.splice(0, this.late.length - MAX_LATE);
    this.flagged = message.flagged ?? [];
    this.roundTrip = message.round_trip ?? 0;
    this.ahead = message.ahead ?? "present";
    this.near = message.near ?? false;
    this.sinceHeard = message.since_heard ?? false;
  }

  /** The timeline with all commands on their way; the known one if there are none. */
  get predicted(): Timeline {
    return this.own ?? this.connection.timeline;
  }

  /** Shows the robot so far ahead from now on. */
  choose(ahead: Ahead): void {
    if (this.connection.send({ type: "ahead", ahead })) this.ahead = ahead;
  }

  /** Whether the robot is shown elsewhere than at its present. */
  get predicts(): boolean {
    return this.ahead !== "present" && this.connection.passes;
  }
  /** The robot's clock as it is heard, D_b late: all before it has happened as the timeline says. */
  heard(now: number): number {
    return Math.min(now, this.cutAt) - this.roundTrip / 2;
  }
  /** The time at which the predicted arm stands. */
  shown(now: number): number {
    if (!this.predicts) return now;
    return this.ahead === "auto" ? now + this.roundTrip / 2 : now - this.roundTrip / 2 + (this.ahead as number);
  }
  /** The time at which the reported arm stands: as it is heard, where another one is predicted. */
  reported(now: number): number {
    return this.predicts ? this.heard(now) : now;
  }
  /** Whether nothing is heard of the robot. */
  get away(): boolean {
    return this.cutAt < Infinity;
  }
  /** The time from which on the robot has not confirmed the timeline; Infinity if all is confirmed. */
  unconfirmed(now: number): number {
    const begins = this.expected.flatMap(({ begin }) => begin ?? []);
    return Math.min(...begins, this.sinceHeard || this.away ? this.heard(now) : Infinity);
  }
  /** What is not confirmed, and why; empty if all is confirmed. */
  doubt(now: number): string {
    const begin = this.unconfirmed(now);
    if (begin === Infinity) return "";
    const dragged = this.sinceHeard ? ["DRAG"] : [];
    const way = [...this.expected.map(({ text }) => text || "a command"), ...dragged].join(", ");
    return `unconfirmed from ${begin.toFixed(3)} s on: ${this.away ? "the robot is not heard" : way}`;
  }
  /** The note about the last flagged span that begins before t, as long as it is fresh; empty if there is none. */
  flag(t: number): string {
    const last = this.flagged.filter(([begin]) => begin <= t).pop();
    if (!last || t >= last[1] + FRESH) return "";
    return `flagged: ${last[0].toFixed(3)} to ${last[1].toFixed(3)} s was shown before a command changed it`;
  }
}
