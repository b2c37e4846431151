import type { Connection } from "./connection";
import type { Model } from "./kinematics";
import type { Timeline } from "./timeline";

/** Where the page has its robot from: a connection, or a file. */
export interface Source {
  readonly model: Model;
  readonly timeline: Timeline;
  /** The timeline as it is expected to become, of a robot behind a delay. */
  readonly predicted?: Timeline;
  /** The robot's clock [s]; of a recording, its end. */
  now(): number;
  /** Whether `now` goes on by itself. */
  readonly passes: boolean;
  /** The name of the robot, or of the file. */
  readonly title: string;
  /** Calls `changed` at each change of the timeline or the clock; returns what ends that. */
  onChange(changed: () => void): () => void;
}

/** A robot that is served. */
export class LiveSource implements Source {
  constructor(private readonly connection: Connection) {}
  get model(): Model {
    return this.connection.welcome!.model;
  }
  get timeline(): Timeline {
    return this.connection.timeline;
  }
  get passes(): boolean {
    return this.connection.passes;
  }
  get title(): string {
    return this.connection.welcome!.robot;
  }
  now(): number {
    return this.connection.now();
  }
  onChange(changed: () => void): () => void {
    const ends = (["change", "clock", "welcome", "state"] as const).map((topic) => this.connection.on(topic, changed));
    return () => ends.forEach((end) => end());
  }
}

/** A saved trajectory. */
export class RecordedSource implements Source {
  readonly passes = false;
  constructor(readonly model: Model, readonly timeline: Timeline, readonly title: string) {}
  now(): number {
    return this.timeline.end;
  }
  onChange(): () => void {
    return () => {};
  }
}
