import { Change } from "./change";
import type { Connection, Message } from "./connection";

const PERIOD = 0.2; // [s] minimum time between two surveys
const PATIENCE = 5; // [s] after which an unanswered survey is repeated

/** Polls the robot's places, programs, branches, tasks, signals and speeds for all parts of the page. */
export class Survey {
  /** The known data; null at first. */
  found: Message | null = null;
  private program = "";
  private asked = ""; // program of the last survey
  private stale = false; // whether something has happened since the last survey
  private asking = false;
  private readonly told = new Change();

  /** `surveyed` is called with each answer that differs from the last. */
  constructor(private readonly connection: Connection, private readonly surveyed: (found: Message) => void) {
    connection.on(["told", "activity", "lease", "welcome", "change"], () => this.happened());
    const status = new Change();
    connection.on("status", ({ around }) => status.to(withoutTime(around)) && this.happened());
    this.happened();
  }

  /** The robot program that runs, or has stopped. */
  get task(): Message | null {
    return this.found?.tasks[0] ?? null;
  }

  /** The program whose current step and breakpoints are polled: the chosen one, or the running one. */
  get chosen(): string {
    return this.program || this.task?.program || "";
  }

  /** Chooses that program; "" for the running one. */
  choose(program: string): void {
    this.program = program;
    this.happened();
  }

  /** Notes that something may have changed: asks soon. */
  happened(): void {
    this.stale = true;
    if (!this.asking) void this.keepUp();
  }

  /** Polls, with pauses, while something happens. */
  private async keepUp(): Promise<void> {
    this.asking = true;
    for (; this.stale; await pause(PERIOD)) {
      this.stale = false;
      if (this.connection.state === "open") this.take(await Promise.race([this.ask(), pause(PATIENCE)]));
    }
    this.asking = false;
  }

  private async ask(): Promise<Message> {
    this.asked = this.chosen;
    const end = await this.connection.ask("at", { act: { kind: "Survey", program: this.asked, known: this.found?.marks ?? [] } });
    return end.found ?? {};
  }

  private take(found: Message | void): void {
    if (found?.kind === "Surveyed") {
      this.found = merged(this.found, found);
      if (this.told.to(this.found)) this.surveyed(this.found);
    }
    if (!found || this.task?.running || this.chosen !== this.asked) this.stale = true;
  }
}

/** Returns the fields of a status that do not change while only time passes. */
export function withoutTime({ clock, end, tool, ...stays }: Message): Message {
  return stays;
}

/** Waits for a time [s]. */
const pause = (seconds: number): Promise<void> => new Promise((done) => setTimeout(done, 1000 * seconds));

/** Completes an answer with the known lists that it omits. */
export const merged = (before: Message | null, now: Message): Message =>
  ({ ...now, places: now.places ?? before?.places ?? null, programs: now.programs ?? before?.programs ?? null });
