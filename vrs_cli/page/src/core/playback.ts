import type { Source } from "./source";

const LEAD = 1; // [s]

/** The displayed time: it follows the robot, is played, or stands. */
export class Playback {
  rate = 1;
  loop = false;
  following: boolean;
  playing = false;
  private at = 0;
  private since = 0;
  private reached = true;
  private atBegin = false; // whether the start is displayed; older parts move the start

  /** `wake` is called when a command has changed the displayed time. `wall`: returns the time of day [s]. */
  constructor(private readonly source: Source, private readonly wake: () => void, private readonly wall: () => number) {
    this.following = source.live;
    this.at = source.live ? source.now() : (source.span?.[0] ?? source.timeline.begin);
    source.onChange(() => {
      if (this.reached) this.since = this.wall();
    });
  }

  /** The first displayed time [s]: a second before the first motion, if the robot stood before it. */
  get begin(): number {
    const { begin, segments } = this.source.timeline;
    if (this.source.span) return this.source.span[0];
    return this.source.passes && segments.length > 1 ? Math.max(begin, segments[1].start - LEAD) : begin;
  }
  /** The last displayable time [s]. */
  get end(): number {
    return this.source.span?.[1] ?? Math.max(this.source.timeline.end, this.source.now());
  }

  /** The displayed time [s]. */
  get time(): number {
    if (this.following) return this.source.passes ? this.source.now() : this.chase(this.source.now());
    if (!this.playing) return this.atBegin ? this.begin : this.at;
    const t = this.at + this.rate * (this.wall() - this.since);
    if (t < this.end) return t;
    if (this.loop && this.end > this.begin) return this.begin + ((t - this.begin) % (this.end - this.begin));
    this.playing = false;
    return (this.at = this.end);
  }

  /** Follows the clock of a robot in virtual time, which jumps over a motion: plays the motion up to the clock. */
  private chase(now: number): number {
    const t = this.at + this.rate * (this.wall() - this.since);
    this.reached = this.at >= now || t >= now;
    if (!this.reached) return t;
    this.since = this.wall();
    return (this.at = now);
  }

  /** Whether the displayed time changes by itself. */
  get moves(): boolean {
    if (this.playing || !this.following) return this.playing;
    return this.source.passes ? this.source.now() <= this.source.timeline.end : this.time < this.source.now();
  }

  follow(): void {
    this.following = this.source.live;
    this.at = this.source.now();
    this.playing = false;
    this.wake();
  }
  seek(t: number): void {
    this.atBegin = t <= this.begin;
    this.at = Math.min(Math.max(t, this.begin), this.end);
    this.since = this.wall();
    this.following = false;
    if (this.at >= this.end && !this.loop) this.playing = false;
    void this.recall();
    this.wake();
  }
  /** Requests older parts while the start of the known timeline is displayed. */
  private async recall(): Promise<void> {
    while (this.atBegin && !this.following && !this.playing && (await this.source.recall?.(this.source.timeline.begin)));
  }
  play(): void {
    this.seek(this.time >= this.end ? this.begin : this.time);
    this.playing = true;
    this.wake();
  }
  pause(): void {
    this.seek(this.time);
    this.playing = false;
    this.wake();
  }
  setRate(rate: number): void {
    const t = this.time;
    this.rate = rate;
    if (!this.following) this.seek(t);
  }
}
