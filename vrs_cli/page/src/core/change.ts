/** Tells whether what is drawn is out of date: its key is another one than the last that was drawn. */
export class Change {
  private drawn: string | null = null;
  private due = -Infinity;
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `period`: between two drawings at least [ms]; `wake` is called when that is over, where one had to wait for it. */
  constructor(private readonly period = 0, private readonly wake: () => void = () => {}) {}

  /** Returns whether to draw now by this key, and takes it as drawn. */
  to(key: unknown): boolean {
    const text = typeof key === "string" ? key : JSON.stringify(key);
    if (text === this.drawn) return false;
    const now = this.period ? performance.now() : 0;
    if (now < this.due) {
      this.timer ??= setTimeout(() => ((this.timer = undefined), this.wake()), this.due - now);
      return false;
    }
    [this.drawn, this.due] = [text, now + this.period];
    return true;
  }

  /** Has all drawn anew, by any key. */
  forget(): void {
    this.drawn = null;
  }
}
