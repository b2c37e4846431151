import type { Connection, Message } from "./core/connection";
import { frames, g } from "./core/kinematics";
import { Playback } from "./core/playback";
import type { Report } from "./core/measured";
import type { Source } from "./core/source";
import type { Timeline } from "./core/timeline";
import { Transform, multiply } from "./core/transform";

/** The state that every part of the page draws, at one time. Metres, radians, seconds. */
export interface Shown {
  /** The displayed time. */
  t: number;
  /** The robot's clock. */
  now: number;
  /** The joints at t. */
  q: number[];
  /** T_base_link of the base and of all links; the last one is the flange. */
  frames: Transform[];
  /** T_robot_tool at t. */
  tool: Transform;
  timeline: Timeline;
  source: Source;
  /** The measured arm at t, or the newest report while the page follows the robot; null if it is unknown. */
  measured: Report | null;
  /** The robot's places, programs, signals and branches; null without a connection. */
  surveyed: Message | null;
}

/** A part of the page that depends on the displayed time. It redraws only after a change. */
export interface Part {
  show(shown: Shown): void;
}

/** Something that the user can show or hide. */
export interface Switch {
  readonly name: string;
  readonly label: string;
  /** A sentence that describes it. */
  readonly hint: string;
  on: boolean;
  set(on: boolean): void;
}

/** A page with one robot. */
export class App {
  readonly parts: Part[] = [];
  readonly playback: Playback;
  /** Data polled from the robot; see Shown. */
  surveyed: Message | null = null;
  private asked = false;

  constructor(readonly source: Source, readonly connection: Connection | null) {
    this.playback = new Playback(source, () => this.wake(), () => performance.now() / 1000);
    source.onChange(() => this.wake());
    setInterval(() => this.asked || document.hidden || this.frame(), 1000); // clocks advance even if nothing asks for a frame of the display
  }

  add(...parts: (Part | void)[]): void {
    this.parts.push(...parts.filter((part) => part !== undefined));
    this.wake();
  }

  /** Draws the page at the next frame of the display. */
  wake(): void {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => this.frame());
  }

  private frame(): void {
    this.asked = false;
    const { source, playback } = this;
    const { timeline, model } = source;
    if (!timeline.segments.length) return;
    const t = playback.time;
    const q = g(model, timeline, t);
    const all = frames(model, q);
    const flange = all[all.length - 1];
    const tool = timeline.tool(t);
    const reported = source.measured?.at(t) ?? null;
    const measured = reported ?? (playback.following ? (source.measured?.last ?? null) : null);
    const shown = { t, now: source.now(), q, frames: all, tool: tool ? multiply(flange, tool) : flange, timeline, source, measured, surveyed: this.surveyed };
    for (const part of this.parts) part.show(shown);
    if (playback.moves) this.wake();
  }
}
