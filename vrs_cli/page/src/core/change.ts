/** Tells whether a drawing is out of date, because its key has changed. */
export class Change {
  private drawn: string | null = null;
  private due = -Infinity;
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `period`: minimum time between two drawings [ms]. `wake` is called at the end of a postponed period. */
  constructor(private readonly period = 0, private readonly wake: () => void = () => {}) {}

  /** Returns whether to draw this key now, and remembers it as drawn. */
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

  /** Forces the next drawing, whatever its key. */
  forget(): void {
    this.drawn = null;
  }
}
