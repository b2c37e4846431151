import type { Message } from "./connection";

const WINDOW = 60; // [s] that exchanges count for: in it sound clocks drift apart by a few ms at most
const MAX_DRIFT = 500e-6; // of a sound clock
const FINEST = 1e-4; // [s]: browsers tell no smaller differences

/** A ping and its answer: in the middle, `at` by the clock here, the clock there was `offset` ahead, if both ways took
 * as long. `trip`: how long both took; `forward`: the clock there on arrival minus the one here on departure. [s] */
interface Exchange {
  at: number;
  forward: number;
  offset: number;
  trip: number;
}

/** Estimates the clock of the server from pings, as NTP does: the exchange with the shortest trip is nearest to the
 * truth. */
export class ServerClock {
  private exchanges: Exchange[] = [];
  private best: Exchange = { at: 0, forward: 0, offset: 0, trip: Infinity };

  /** Takes a first guess: `there` showed this when a message that came `here` was made. */
  guess(here: number, there: number): void {
    if (!this.exchanges.length) this.best = { at: here, forward: there - here, offset: there - here, trip: Infinity };
  }

  /** Takes an exchange: sent at t0, there from t1 to t2, back at t3. */
  heard(t0: number, t1: number, t2: number, t3: number): void {
    const now = { at: (t0 + t3) / 2, forward: t1 - t0, offset: (t1 - t0 + (t2 - t3)) / 2, trip: t3 - t0 - (t2 - t1) };
    const mayBe = (this.best.trip + now.trip) / 2 + MAX_DRIFT * Math.abs(now.at - this.best.at) + FINEST;
    if (Math.abs(now.offset - this.best.offset) > mayBe) this.exchanges = []; // a clock was set, or this machine slept
    this.exchanges = [...this.exchanges.filter(({ at }) => at >= now.at - WINDOW), now];
    this.best = this.exchanges.reduce((best, one) => (best.trip <= one.trip ? best : one));
  }

  /** The shortest trip there and back that was seen lately [s]; infinite before the first. */
  get trip(): number {
    return this.best.trip;
  }

  /** D_f, the longest way to the server that was seen lately [s]; 0 before the first. It is wrong by half of what the two
   * ways differ in at least. */
  get forward(): number {
    return Math.max(...this.exchanges.map(({ forward }) => forward), this.best.forward) - this.best.offset;
  }

  /** Returns what the clock of the server shows when the one here shows this. */
  there(here: number): number {
    return here + this.best.offset;
  }
}

/** Returns the robot's clock `now` when the server's clock shows `wall`. */
export function robotClock(clock: Message, wall: number): number {
  const passes = clock.realtime && !clock.paused;
  return passes ? clock.now + (clock.rate ?? 1) * (wall - (clock.wall ?? 0)) : clock.now;
}
