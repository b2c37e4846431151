import type { Connection } from "./connection";
import type { Model } from "./kinematics";
import { Measured } from "./measured";
import { Preview } from "./preview";
import type { Timeline } from "./timeline";
import { World } from "./world";

/** Where the page has its robot from: a connection, or a file. */
export interface Source {
  readonly model: Model;
  readonly timeline: Timeline;
  /** What is expected of a robot that is served; `timeline` is the predicted one. */
  readonly preview?: Preview;
  /** What the body of a robot that is served measures. */
  readonly measured?: Measured;
  /** What is around the robot; null where there is nothing. */
  readonly cell: Cell | null;
  /** Where its parts are. */
  readonly world: World;
  /** The time that is followed [s]: the robot's clock, or that clock as it is heard; of a recording, its end. */
  now(): number;
  /** Whether there is a robot, which is followed at first. */
  readonly live: boolean;
  /** Whether `now` goes on by itself. */
  readonly passes: boolean;
  /** The times that are played [s]; absent: all. */
  readonly span?: [number, number];
  /** The name of the robot, or of the file. */
  readonly title: string;
  /** Asks for what was before a time [s], where it is not known. Returns whether there is more of it now. */
  recall?(before: number): Promise<boolean>;
  /** Calls `changed` at each change of the timeline or the clock. */
  onChange(changed: () => void): void;
}

/** A cell as the welcome has it; src/scene/parts.ts reads its scene. */
export interface Cell {
  scene: object;
}

const MEASURED_PERIOD = 0.2; // [s] between two looks at what is measured, where nothing else moves
const STEADY = 1e-4; // [rad, m] of a joint: what is measured and has changed by less is shown with the clock
const RECALLED = 600; // [s] that are asked for at once

/** A robot that is served. */
export class LiveSource implements Source {
  readonly live = true;
  readonly preview: Preview;
  readonly measured: Measured;
  readonly world = new World();
  private recalling = false;

  constructor(private readonly connection: Connection) {
    this.preview = new Preview(connection);
    this.measured = new Measured(connection);
    connection.on("welcome", () => this.world.clear());
    connection.on(["course", "contacts"], (message) => this.world.hear(message));
  }
  get cell(): Cell | null {
    return this.connection.welcome!.cell ?? null;
  }
  get model(): Model {
    return this.connection.welcome!.model;
  }
  get timeline(): Timeline {
    return this.preview.predicted;
  }
  get passes(): boolean {
    return this.connection.passes;
  }
  get title(): string {
    return this.connection.welcome!.robot;
  }
  now(): number {
    return this.preview.reported(this.connection.now());
  }
  async recall(before: number): Promise<boolean> {
    if (this.recalling) return false;
    this.recalling = true;
    return this.connection.recall(before - RECALLED).finally(() => (this.recalling = false));
  }
  onChange(changed: () => void): void {
    let waits = 0;
    let seen: number[] = [];
    const measured = (): void => {
      const q = this.measured.last?.q ?? [];
      if (waits || q.every((x, i) => Math.abs(x - seen[i]) < STEADY)) return;
      seen = q;
      waits = setTimeout(() => ((waits = 0), changed()), 1000 * MEASURED_PERIOD) as unknown as number;
    };
    const topics = ["change", "clock", "welcome", "state", "preview", "course", "contacts", "shownmeasured", "bodystatus", "alarm"];
    this.connection.on(topics, changed);
    this.connection.on("measurements", measured);
  }
}
