import type { Connection, Message } from "./connection";
import type { DeltaRecord, Timeline } from "./timeline";

/** How far ahead of the received state the robot is shown: at its present, at the arrival of a command, or by a time [s]. */
export type Ahead = "present" | "auto" | number;

/** A command under way and its effect, with the field names of the wire. Without `begin` it changes nothing. */
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

/** [s] that a note about a span stays after its end. */
const FRESH = 3;
const MAX_LATE = 20; // maximum number of remembered commands

/**
 * What is expected of a robot that is served. Of one behind a line with delays `vrs view` computes it, and tells it by
 * the message `preview`; without such a message nothing is known but that a connection is cut.
 * D_f is the delay of a command, D_b that of an answer; times are those of the robot's clock [s].
 */
export class Preview {
  expected: Expected[] = [];
  flagged: Span[] = [];
  /** The last commands that the robot refused or missed. */
  readonly late: Expected[] = [];
  /** D_f + D_b, in seconds of the robot. */
  roundTrip = 0;
  ahead: Ahead = "present";
  /** Whether the delays are too short to matter, or unknown. */
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

  /** The timeline with all commands under way; without any, the known one. */
  get predicted(): Timeline {
    return this.own ?? this.connection.timeline;
  }

  /** Chooses how far ahead the robot is shown. */
  choose(ahead: Ahead): void {
    if (this.connection.send({ type: "ahead", ahead })) this.ahead = ahead;
  }

  /** Whether the robot is shown ahead of the received state. */
  get predicts(): boolean {
    return this.ahead !== "present" && this.connection.passes;
  }
  /** The robot's clock as received, D_b late: the timeline before it is certain. */
  heard(now: number): number {
    return Math.min(now, this.cutAt) - this.roundTrip / 2;
  }
  /** The time of the predicted arm. */
  shown(now: number): number {
    if (!this.predicts) return now;
    return this.ahead === "auto" ? now + this.roundTrip / 2 : now - this.roundTrip / 2 + (this.ahead as number);
  }
  /** The time of the reported arm: that of the received clock if another arm is predicted. */
  reported(now: number): number {
    return this.predicts ? this.heard(now) : now;
  }
  /** Whether the robot's messages have stopped. */
  get away(): boolean {
    return this.cutAt < Infinity;
  }
  /** The time after which the timeline is not confirmed; Infinity if all is confirmed. */
  unconfirmed(now: number): number {
    const begins = this.expected.flatMap(({ begin }) => begin ?? []);
    return Math.min(...begins, this.sinceHeard || this.away ? this.heard(now) : Infinity);
  }
  /** Describes what is not confirmed, and why; empty if all is confirmed. */
  doubt(now: number): string {
    const begin = this.unconfirmed(now);
    if (begin === Infinity) return "";
    const dragged = this.sinceHeard ? ["DRAG"] : [];
    const way = [...this.expected.map(({ text }) => text || "a command"), ...dragged].join(", ");
    return `unconfirmed from ${begin.toFixed(3)} s on: ${this.away ? "the robot is not heard" : way}`;
  }
  /** The note about the last flagged span before t while it is recent, else empty. */
  flag(t: number): string {
    const last = this.flagged.filter(([begin]) => begin <= t).pop();
    if (!last || t >= last[1] + FRESH) return "";
    return `flagged: ${last[0].toFixed(3)} to ${last[1].toFixed(3)} s was shown before a command changed it`;
  }
}
