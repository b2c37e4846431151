import type { Playback } from "./playback";
import { type Timeline, countUntil } from "./timeline";

const STEPS = [1, 2, 5, 10];

/** A span of time [s]. */
export interface Span {
  low: number;
  high: number;
}

export const PHASES = ["rest", "cruise", "accelerate", "decelerate", "blend"] as const;
/** Displayed lengths of the timeline [s], in the order of the zoom key. */
export const ZOOMS = [Infinity, 60, 20, 5];

/** Returns the index of the first segment that ends after t. */
const segmentAt = ({ segments }: Timeline, t: number): number => countUntil(segments, t, ({ finish }) => finish);

/** Returns a step of 1, 2 or 5 times a power of ten that fits into a length at most `most` times. */
export function roundStep(length: number, most: number): number {
  const power = 10 ** Math.floor(Math.log10(length / most));
  return power * STEPS.find((step) => step * power * most >= length * (1 - 1e-9))!;
}

/** Returns the displayed span: all between round times, or the page of a zoom that contains t. */
export function spanOf(playback: Playback, zoom: number, t: number): Span {
  if (zoom !== Infinity) {
    const low = Math.floor(t / zoom) * zoom;
    return { low, high: low + zoom };
  }
  const high = Math.max(playback.end, playback.begin + 1);
  const step = roundStep(high - playback.begin, 20);
  return { low: Math.floor(playback.begin / step) * step, high: Math.ceil((high - 1e-9) / step) * step };
}

/** Returns the share of each phase in each of `columns` equal parts of a span: rows of PHASES; the rest is rest. */
export function shares(timeline: Timeline, span: Span, columns: number): Float32Array {
  const found = new Float32Array(columns * PHASES.length);
  const scale = columns / (span.high - span.low);
  for (let i = segmentAt(timeline, span.low); i < timeline.segments.length; i++) {
    const segment = timeline.segments[i];
    const phase = PHASES.indexOf(segment.phase as (typeof PHASES)[number]);
    const from = Math.max((segment.start - span.low) * scale, 0);
    const to = Math.min((segment.finish - span.low) * scale, columns);
    if (from >= columns) break;
    if (phase <= 0) continue;
    for (let column = Math.floor(from); column < to; column++)
      found[column * PHASES.length + phase] += Math.min(to, column + 1) - Math.max(from, column);
  }
  return found;
}

/** Returns when commands begin in a span, with their texts. */
export function commandsIn(timeline: Timeline, span: Span): { t: number; text: string }[] {
  const found = [];
  for (let i = segmentAt(timeline, span.low); i < timeline.segments.length; i++) {
    const { start, motion } = timeline.segments[i];
    if (start >= span.high) break;
    if (motion.text && start >= span.low && timeline.segments[i - 1]?.motion.number !== motion.number) found.push({ t: start, text: motion.text });
  }
  return found;
}

/** Returns what the robot does at t: the text of the command, and its phase. */
export function doingAt(timeline: Timeline, t: number): { text: string; phase: string } {
  const [{ motion, phase }] = timeline.locate(t);
  return timeline.moves(t) ? { text: motion.text || motion.kind, phase } : { text: "at rest", phase: "rest" };
}

/** Returns when the next command after t begins (`sign` 1), or the one before t (-1) [s]; the end, or the begin, if there is none. */
export function commandFrom(timeline: Timeline, t: number, sign: 1 | -1): number {
  const begins = timeline.begins().slice(1);
  if (sign > 0) return begins.find((begin) => begin > t + 1e-9) ?? timeline.end;
  return begins.reverse().find((begin) => begin < t - 1e-9) ?? timeline.begin;
}
