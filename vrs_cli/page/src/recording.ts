import { App } from "./app";
import type { Message } from "./core/connection";
import type { Model } from "./core/kinematics";
import { RecordedSource } from "./core/source";
import { SnapshotRecord, Timeline } from "./core/timeline";
import type { makeLayout } from "./layout";
import { makeViewing } from "./panels/viewing";
import { makeScene } from "./scene/scene";

/** A trajectory without a robot: what `recorded_page` in vrs_cli/net/recorded_page.py writes. */
export interface Recording {
  title: string;
  rate: number;
  model: Model;
  snapshot: SnapshotRecord;
  cell: Message | null;
}

/** Shows a recording in a layout, and plays it from its begin. */
export function showRecording(data: Recording, slot: ReturnType<typeof makeLayout>): void {
  const timeline = new Timeline();
  timeline.replace(data.snapshot);
  const app = new App(new RecordedSource(data.model, timeline, data.title), null);
  const scene = makeScene(app, slot("canvas"));
  makeViewing(app, slot, scene);
  app.playback.rate = data.rate;
  app.playback.play();
  Object.assign(window, { app, scene }); // for tests and the curious
}
