import { type Transform, identity, inverse, transformOf } from "./transform";

/** Coefficients of a polynomial, lowest power first. */
export type Polynomial = number[];

/** A straight line: T_robot_tool by time, and the joints at some times, which tell the configuration and the turns. */
export interface Line {
  position: [Polynomial, Polynomial, Polynomial];
  orientation: number[][];
  turns: { axis: number[]; angle: Polynomial }[];
  seeds: number[][];
  seed_interval: number;
  guides?: { weights: number[]; value: Polynomial }[];
}
export interface Motion {
  number: number;
  text?: string;
  kind: string;
  frames?: { base?: number[][]; tool?: number[][] };
}
export interface SegmentRecord {
  start: number;
  finish: number;
  phase: string;
  motion?: Motion | number;
  joints?: Polynomial[];
  line?: Line;
}
/** A dated event: at a time a channel (0: the hand, else a signal) takes a value, or a program observed one. */
export interface EventRecord {
  time: number;
  channel: number;
  value: number;
  duration?: number;
  observed?: boolean;
}
export interface DeltaRecord {
  version: number;
  motion: Motion | number;
  cut: number;
  keep: number;
  drop: number;
  segments: SegmentRecord[];
  shift?: number;
  events?: { keep: number; drop?: number; shift?: number; events?: EventRecord[] };
}
export interface SnapshotRecord {
  version: number;
  segments: SegmentRecord[];
  first?: number;
  events?: EventRecord[];
  values?: EventRecord[];
  first_event?: number;
}

/** A segment of the timeline, with its motion. */
export interface Segment extends Omit<SegmentRecord, "motion"> {
  motion: Motion;
}

const HAND = 0; // the channel of the hand: 1 open, 0 closed

/** Returns the number of rows with a time of at most t; rows are in order of time. */
export function countUntil<R>(rows: R[], t: number, time: (row: R) => number): number {
  let [low, high] = [0, rows.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (time(rows[middle]) <= t) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Returns T_flange_tool of a motion; undefined for the flange itself. */
export const toolOf = ({ frames }: Motion): Transform | undefined => frames?.tool && transformOf(frames.tool);

/** Returns T_world_robot of a motion, as BASE has set it. */
export const baseOf = ({ frames }: Motion): Transform => (frames?.base ? inverse(transformOf(frames.base)) : identity());

/** Evaluates a polynomial by Horner's scheme, in the order of vrs itself: equal to the bit. */
export function value(a: Polynomial, s: number): number {
  let r = 0;
  for (let i = a.length - 1; i >= 0; i--) r = r * s + a[i];
  return r;
}

/** A mirror of the robot's timeline: a snapshot, then delta after delta. */
export class Timeline {
  segments: Segment[] = [];
  /** The number of the first segment that is known. */
  first = 0;
  version = -1;
  /** The number of the last change. */
  number = 0;
  /** The dated events that are known, in order of time. */
  events: EventRecord[] = [];
  private firstEvent = 0;
  /** The last event of each channel before the known ones. */
  private values: EventRecord[] = [];

  get begin(): number {
    return this.segments.length ? this.segments[0].start : 0;
  }
  get end(): number {
    return this.segments.length ? this.segments[this.segments.length - 1].finish : 0;
  }

  replace(snapshot: SnapshotRecord, number = 0): void {
    this.segments = segmentsOf(snapshot.segments);
    this.first = snapshot.first ?? 0;
    this.version = snapshot.version;
    this.number = number;
    this.events = snapshot.events ?? [];
    this.values = snapshot.values ?? [];
    this.firstEvent = snapshot.first_event ?? 0;
  }

  /** Applies a change; returns false if it does not fit and a snapshot is needed. */
  apply(delta: DeltaRecord, number: number): boolean {
    const keep = delta.keep - this.first;
    const edit = delta.events;
    const kept = (edit?.keep ?? this.firstEvent) - this.firstEvent;
    if (number !== this.number + 1 || delta.version !== this.version || keep < 1 || kept < 0) return false;
    if (keep + delta.drop > this.segments.length) return false;
    const [last, tail] = [this.segments[keep - 1], this.segments.slice(keep + delta.drop)];
    this.segments.length = keep;
    if (last.finish > delta.cut) this.segments[keep - 1] = { ...last, finish: delta.cut };
    const motion = typeof delta.motion === "number" ? this.motion(delta.motion, tail) : delta.motion;
    this.segments.push(...segmentsOf(delta.segments, motion));
    const shift = delta.shift ?? 0;
    for (const s of tail) this.segments.push(shift ? { ...s, start: s.start + shift, finish: s.finish + shift } : s);
    if (edit) {
      const late = this.events.slice(kept + (edit.drop ?? 0));
      this.events.length = kept;
      this.events.push(...(edit.events ?? []), ...late.map((e) => (edit.shift ? { ...e, time: e.time + edit.shift } : e)));
    }
    this.version++;
    this.number = number;
    return true;
  }

  /** Returns an independent copy. */
  copy(): Timeline {
    return Object.assign(new Timeline(), this, { segments: [...this.segments], events: [...this.events] });
  }

  /** Prepends an older part; returns false if it does not fit. */
  prepend(older: SnapshotRecord, number: number): boolean {
    const first = older.first ?? 0;
    const count = this.first - first;
    if (number !== this.number || count < 1 || older.segments.length < count) return false;
    const firstEvent = older.first_event ?? 0;
    this.segments = segmentsOf(older.segments).slice(0, count).concat(this.segments);
    this.first = first;
    if (older.events && firstEvent <= this.firstEvent) {
      this.events = older.events.slice(0, this.firstEvent - firstEvent).concat(this.events);
      this.firstEvent = firstEvent;
      this.values = older.values ?? [];
    }
    return true;
  }

  /** Returns the segment at t, and the time in it [s]: in a gap and after the end, the end of the one before. */
  locate(t: number): [Segment, number] {
    const segment = this.segments[this.index(t)];
    return [segment, Math.min(Math.max(t - segment.start, 0), segment.finish - segment.start)];
  }

  /** Returns the index of the last segment that has begun at t, 0 before all. */
  index(t: number): number {
    return Math.max(countUntil(this.segments, t, ({ start }) => start) - 1, 0);
  }

  /** Returns the last event until t that set a channel. */
  lastEvent(channel: number, t: number): EventRecord | undefined {
    return [...this.values, ...this.events].filter((event) => event.channel === channel && !event.observed && event.time <= t).pop();
  }

  /** Returns how far the hand is open at t: 1 open, 0 closed. `stopped`: the same for resting fingers,
   * if it is known whether a part between them has stopped them. */
  hand(t: number, stopped: (t: number) => number | undefined = () => undefined): number {
    const last = this.lastEvent(HAND, t);
    const share = last?.duration ? (t - last.time) / last.duration : 1;
    if (!last || share >= 1) return stopped(t) ?? last?.value ?? 0;
    const early = last.time - 1e-9;
    const before = stopped(early) ?? this.lastEvent(HAND, early)?.value ?? 0;
    return before + share * ((stopped(last.time + last.duration!) ?? last.value) - before);
  }

  /** Returns T_flange_tool at t, undefined for the flange itself. */
  tool(t: number): Transform | undefined {
    return toolOf(this.locate(t)[0].motion);
  }

  /** Returns T_world_robot at t. */
  base(t: number): Transform {
    return baseOf(this.locate(t)[0].motion);
  }

  /** Returns whether the robot moves at t. */
  moves(t: number): boolean {
    const [{ phase, start, finish }] = this.locate(t);
    return phase !== "rest" && t >= start && t < finish;
  }

  /** Returns the start times of the known commands, in order. */
  begins(): number[] {
    const { segments } = this;
    return segments.filter((s, i) => i === 0 || segments[i - 1].motion.number !== s.motion.number).map((s) => s.start);
  }

  /** Returns the end of the motion at t, or of the last motion. */
  finishAfter(t: number): number {
    const { segments } = this;
    let last = this.index(t);
    while (segments[last + 1]?.motion.number === segments[last].motion.number) last++;
    return segments[last].finish;
  }

  private motion(number: number, tail: Segment[]): Motion {
    const found = [...this.segments].reverse().concat(tail).find((s) => s.motion.number === number);
    return found?.motion ?? { number, kind: "" };
  }
}

/** Gives segments their motions; a message describes each motion once, and later refers to it by number. */
function segmentsOf(records: SegmentRecord[], motion?: Motion): Segment[] {
  const known = new Map<number, Motion>();
  if (motion) known.set(motion.number, motion);
  let last = motion;
  return records.map((record) => {
    const { motion: of } = record;
    if (typeof of === "object") known.set(of.number, of);
    const its = typeof of === "number" ? known.get(of) : (of ?? motion ?? last);
    last = its;
    return { ...record, motion: its! };
  });
}
