/** How finely the picture is drawn. */
export interface Quality {
  readonly shadow: boolean;
  readonly antialias: boolean;
  /** Maximum number of pixels of the picture per CSS pixel. */
  readonly ratio: number;
}

/** From the finest to the fastest. */
export const QUALITIES: Quality[] = [
  { shadow: true, antialias: true, ratio: 2 },
  { shadow: true, antialias: true, ratio: 1 },
  { shadow: false, antialias: true, ratio: 1 },
  { shadow: false, antialias: false, ratio: 1 },
  { shadow: false, antialias: false, ratio: 0.67 },
];
const PICTURES = 30;
const SLOW = 50; // [ms] a longer median time between pictures lowers the quality
const FAST = 22; // [ms] a shorter median raises it
const GAP = 1000; // [ms] a longer pause means that the page was hidden or nothing moved
const PATIENCE = 30_000; // [ms] before a quality that was too slow is tried again; it doubles each time

/** Chooses the quality by the time between pictures that follow each other without a pause. */
export class QualityControl {
  private times: number[] = [];
  private last = -Infinity;
  private patience = PATIENCE;
  private since = -Infinity;
  /** Whether the quality stays fixed. */
  fixed = false;

  constructor(public level = 0) {}

  get quality(): Quality {
    return QUALITIES[this.level];
  }

  /** Records a picture drawn at `now` [ms]; `follows`: it was requested right after the one before. Returns whether the quality changes. */
  drawn(now: number, follows: boolean): boolean {
    const time = now - this.last;
    this.last = now;
    if (!follows || time > GAP || this.fixed) return false;
    this.times.push(time);
    if (this.times.length < PICTURES) return false;
    const median = this.times.sort((a, b) => a - b)[PICTURES / 2];
    this.times = [];
    if (median > SLOW && this.level < QUALITIES.length - 1) {
      if (now - this.since < this.patience) this.patience *= 2;
      this.level++;
      this.since = now;
      return true;
    }
    if (median < FAST && this.level > 0 && now - this.since > this.patience) {
      this.level--;
      this.since = now;
      return true;
    }
    return false;
  }
}
