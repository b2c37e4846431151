import { Change } from "./change";
import type { Connection, Message } from "./connection";

const PERIOD = 0.2; // [s] between two surveys at least
const PATIENCE = 5; // [s] until a survey without an answer is asked for again

/** Asks what the robot has beside its timeline (places, programs, branches, tasks, signals, speeds), once for all parts. */
export class Survey {
  /** All that is known, null at first. */
  found: Message | null = null;
  private program = "";
  private asked = ""; // the program of the last survey
  private stale = false; // something has happened since the last survey
  private asking = false;
  private readonly told = new Change();

  /** `surveyed` is called with each answer that is another one. */
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

  /** The program whose mark and breakpoints are asked for: the one that was chosen, or the one that runs. */
  get chosen(): string {
    return this.program || this.task?.program || "";
  }

  /** Chooses that program; "" for the one that runs. */
  choose(program: string): void {
    this.program = program;
    this.happened();
  }

  /** Notes that something may have changed: asks soon. */
  happened(): void {
    this.stale = true;
    if (!this.asking) void this.keepUp();
  }

  /** Asks, with pauses, as long as something happens. */
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

/** Returns what stays of a status, which the server tells each second, while nothing but time passes. */
export function withoutTime({ clock, end, tool, ...stays }: Message): Message {
  return stays;
}

/** Waits for so long [s]. */
const pause = (seconds: number): Promise<void> => new Promise((done) => setTimeout(done, 1000 * seconds));

/** Completes an answer by the lists that it leaves out because they are known. */
export const merged = (before: Message | null, now: Message): Message =>
  ({ ...now, places: now.places ?? before?.places ?? null, programs: now.programs ?? before?.programs ?? null });
