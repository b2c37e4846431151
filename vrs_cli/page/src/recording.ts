import { App } from "./app";
import type { Model } from "./core/kinematics";
import { RecordedSource, type Cell } from "./core/source";
import { SnapshotRecord, Timeline } from "./core/timeline";
import { World, type ContactSpan, type CourseRows } from "./core/world";
import type { makeLayout } from "./layout";
import { makeViewing } from "./panels/viewing";
import { makeScene } from "./scene/scene";

/** A trajectory without a robot: what `recorded_page` in vrs_cli/net/recorded_page.py writes. */
export interface Recording {
  title: string;
  rate: number;
  model: Model;
  snapshot: SnapshotRecord;
  cell: Cell | null;
  world: { rows: CourseRows; touches: ContactSpan[] | null; until: number | null } | null;
}

/** Shows a recording in a layout, and plays it from its begin. */
export function showRecording(data: Recording, slot: ReturnType<typeof makeLayout>): void {
  const timeline = new Timeline();
  timeline.replace(data.snapshot);
  const { world: course } = data;
  const world = course ? World.of(course.rows, course.touches, course.until) : new World();
  const app = new App(new RecordedSource(data.model, timeline, data.title, data.cell, world), null);
  const scene = makeScene(app, slot("canvas"));
  makeViewing(app, slot, scene);
  app.playback.rate = data.rate;
  app.playback.play();
  Object.assign(window, { app, scene }); // for tests and the curious
}
