import type { Message } from "./connection";

const WINDOW = 300; // [s] that exchanges count for
const PARTS = 16; // of the window: the best exchange of each tells how the clocks drift apart
const FEWEST = 4; // such exchanges
const MAX_DRIFT = 500e-6; // of a sound clock
const FINEST = 1e-4; // [s]: browsers tell no smaller differences

/** A ping and its answer: in the middle, `at` by the clock here, the clock there was `offset` ahead, if both ways took
 * as long. `trip`: how long both took. [s] */
interface Exchange {
  at: number;
  offset: number;
  trip: number;
}

/** Estimates the clock of the server from pings, as NTP does: the exchange with the shortest trip is nearest to the
 * truth. See vrs_cli/net/timesync.py. */
export class ServerClock {
  private exchanges: Exchange[] = [];
  private estimate: Exchange & { drift: number } | null = null;

  /** Takes a first guess: `there` showed this when a message that came `here` was made. */
  guess(here: number, there: number): void {
    if (!this.exchanges.length) this.estimate = { at: here, offset: there - here, trip: Infinity, drift: 0 };
  }

  /** Takes an exchange: sent at t0, there from t1 to t2, back at t3. */
  heard(t0: number, t1: number, t2: number, t3: number): void {
    const now = { at: (t0 + t3) / 2, offset: (t1 - t0 + (t2 - t3)) / 2, trip: t3 - t0 - (t2 - t1) };
    const best = shortest(this.exchanges) ?? now;
    const mayBe = (best.trip + now.trip) / 2 + MAX_DRIFT * Math.abs(now.at - best.at) + FINEST;
    if (Math.abs(now.offset - best.offset) > mayBe) this.exchanges = []; // a clock was set, or this machine slept
    this.exchanges = [...this.exchanges.filter(({ at }) => at >= now.at - WINDOW), now];
    this.estimate = { ...shortest(this.exchanges)!, drift: drift(this.exchanges) };
  }

  /** The shortest trip there and back that was seen lately [s]; infinite before the first. */
  get trip(): number {
    return this.estimate?.trip ?? Infinity;
  }

  /** What the clock of the server shows when the one here shows this. */
  there(here: number): number {
    const { at, offset, drift } = this.estimate ?? { at: 0, offset: 0, drift: 0 };
    return here + offset + drift * (here - at);
  }
}

function shortest(exchanges: Exchange[]): Exchange | undefined {
  return exchanges.reduce<Exchange | undefined>((best, one) => (best && best.trip <= one.trip ? best : one), undefined);
}

/** The drift of the clocks: the slope of the offsets of the best exchange of each part of the window. */
function drift(exchanges: Exchange[]): number {
  const parts = new Map<number, Exchange[]>();
  for (const one of exchanges) {
    const part = Math.floor(one.at / (WINDOW / PARTS));
    parts.set(part, [...(parts.get(part) ?? []), one]);
  }
  if (parts.size < FEWEST) return 0;
  const best = [...parts.values()].map((part) => shortest(part)!);
  const mean = (of: (one: Exchange) => number): number => best.reduce((sum, one) => sum + of(one), 0) / best.length;
  const [t, x] = [mean((one) => one.at), mean((one) => one.offset)];
  const slope = mean((one) => (one.at - t) * (one.offset - x)) / mean((one) => (one.at - t) ** 2);
  const unsure = mean((one) => one.trip) / (WINDOW / PARTS) / best.length; // what trips of different lengths make of it
  return Math.abs(slope) < unsure ? 0 : Math.min(Math.max(slope, -MAX_DRIFT), MAX_DRIFT);
}

/** The robot's clock `now` when the server's clock shows `wall`. */
export function robotClock(clock: Message, wall: number): number {
  const passes = clock.realtime && !clock.paused;
  return passes ? clock.now + (clock.rate ?? 1) * (wall - (clock.wall ?? 0)) : clock.now;
}
