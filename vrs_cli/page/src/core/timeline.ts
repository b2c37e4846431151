import { Transform, transformOf } from "./transform";

/** Coefficients of a polynomial, lowest power first. */
export type Polynomial = number[];

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
  hand?: number;
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
export interface DeltaRecord {
  version: number;
  motion: Motion | number;
  cut: number;
  keep: number;
  drop: number;
  segments: SegmentRecord[];
  shift?: number;
}
export interface SnapshotRecord {
  version: number;
  segments: SegmentRecord[];
  first?: number;
}

/** A segment of the timeline, with its motion. */
export interface Segment extends Omit<SegmentRecord, "motion"> {
  motion: Motion;
}

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
  private motions = new Map<number, Motion>();

  get begin(): number {
    return this.segments.length ? this.segments[0].start : 0;
  }
  get end(): number {
    return this.segments.length ? this.segments[this.segments.length - 1].finish : 0;
  }

  replace(snapshot: SnapshotRecord, number = 0): void {
    this.first = snapshot.first ?? 0;
    this.version = snapshot.version;
    this.number = number;
    let last: Motion | undefined;
    this.segments = snapshot.segments.map((record) => ({ ...record, motion: (last = this.motion(record.motion, last)) }));
  }

  /** Applies a change; false if it does not fit, and a snapshot has to be asked for. */
  apply(delta: DeltaRecord, number: number): boolean {
    const keep = delta.keep - this.first;
    if (number !== this.number + 1 || delta.version !== this.version || keep < 1) return false;
    const motion = this.motion(delta.motion, undefined);
    const tail = this.segments.slice(keep + delta.drop);
    this.segments.length = keep;
    const last = this.segments[keep - 1];
    if (last.finish > delta.cut) this.segments[keep - 1] = { ...last, finish: delta.cut };
    for (const record of delta.segments) this.segments.push({ ...record, motion: this.motion(record.motion, motion) });
    const shift = delta.shift ?? 0;
    for (const s of tail) this.segments.push(shift ? { ...s, start: s.start + shift, finish: s.finish + shift } : s);
    this.version++;
    this.number = number;
    return true;
  }

  /** Returns a timeline with the same segments, which changes by itself. */
  copy(): Timeline {
    const own = { segments: [...this.segments], motions: new Map(this.motions) };
    return Object.assign(new Timeline(), this, own);
  }

  /** Returns the segment at t, and the time in it [s]. */
  locate(t: number): [Segment, number] {
    let low = 0;
    let high = this.segments.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.segments[middle].start <= t) low = middle;
      else high = middle - 1;
    }
    const segment = this.segments[low];
    return [segment, Math.min(Math.max(t - segment.start, 0), segment.finish - segment.start)];
  }

  /** Returns the tool in force at t: T_flange_tool, undefined for the flange itself. */
  tool(t: number): Transform | undefined {
    const rows = this.locate(t)[0].motion.frames?.tool;
    return rows && transformOf(rows);
  }

  private motion(of: Motion | number | undefined, other: Motion | undefined): Motion {
    if (of === undefined) return other!;
    if (typeof of === "number") return this.motions.get(of)!;
    this.motions.set(of.number, of);
    return of;
  }
}
