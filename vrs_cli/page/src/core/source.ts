import type { Connection } from "./connection";
import type { Model } from "./kinematics";
import { Measured } from "./measured";
import { Preview } from "./preview";
import type { Timeline } from "./timeline";
import { World } from "./world";

/** The source of the page's robot: a connection, or a file. */
export interface Source {
  readonly model: Model;
  readonly timeline: Timeline;
  /** The preview of a served robot; then `timeline` is the predicted one. */
  readonly preview?: Preview;
  /** The reports of a served robot's body. */
  readonly measured?: Measured;
  /** The cell around the robot; null without a cell. */
  readonly cell: Cell | null;
  /** The parts of the cell over time. */
  readonly world: World;
  /** The time to follow [s]: the robot's clock, or the received clock; of a recording, its end. */
  now(): number;
  /** Whether there is a robot to follow. */
  readonly live: boolean;
  /** Whether `now` advances by itself. */
  readonly passes: boolean;
  /** The span to play [s]; absent: all. */
  readonly span?: [number, number];
  /** The name of the robot, or of the file. */
  readonly title: string;
  /** Asks for the unknown part before a time [s]. Returns whether more is known now. */
  recall?(before: number): Promise<boolean>;
  /** Calls `changed` at each change of the timeline or the clock. */
  onChange(changed: () => void): void;
}

/** A cell as the welcome has it; src/scene/parts.ts reads its scene. */
export interface Cell {
  scene: object;
}

const MEASURED_PERIOD = 0.2; // [s] between two displays of measured values, if nothing else moves
const STEADY = 1e-4; // [rad, m] of a joint: a smaller change of measured values is not drawn at once
const RECALLED = 600; // [s] length of one request

/** A served robot. */
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
