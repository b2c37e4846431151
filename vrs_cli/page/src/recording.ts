import { App } from "./app";
import type { Message } from "./core/connection";
import type { Model } from "./core/kinematics";
import { RecordedSource, type Cell } from "./core/source";
import { SnapshotRecord, Timeline } from "./core/timeline";
import { World, type ContactSpan, type CourseRows } from "./core/world";
import { h } from "./dom";
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
  /** The locations that its motions name, with T_world_tool. */
  places: Message[];
  /** The times that are played [s]; null: all. */
  between: [number, number] | null;
  /** The quality of photographs, 1 the finest: only the picture is shown. 0: all of the page. */
  picture: number;
}

function appOf(data: Recording): App {
  const timeline = new Timeline();
  timeline.replace(data.snapshot);
  const world = data.world ? World.of(data.world.rows, data.world.touches, data.world.until) : undefined;
  const app = new App(new RecordedSource(data.model, timeline, data.title, data.cell, world, data.between ?? undefined), null);
  app.surveyed = { places: { more: 0, rows: data.places } };
  app.playback.rate = data.rate;
  return app;
}

/** Shows a recording in a layout, and plays it from its begin. */
export function showRecording(data: Recording, slot: ReturnType<typeof makeLayout>): void {
  const app = appOf(data);
  const scene = makeScene(app, slot("canvas"));
  makeViewing(app, slot, scene);
  app.playback.play();
  Object.assign(window, { app, scene }); // for tests and the curious
}

/** Shows the picture of a recording alone: `ready` when all is there, then `take` shows a moment with a caption. */
export function photograph(data: Recording): void {
  const app = appOf(data);
  const caption = h("p", { class: "caption" });
  const view = h("main", { class: "picture" }, caption);
  document.body.append(view);
  const scene = makeScene(app, view);
  scene.stage.fix(data.picture - 1);
  for (const layer of scene.layers) if (layer.name === "goal") layer.set(false);
  const take = async (t: number, text: string): Promise<void> => {
    caption.textContent = text;
    app.playback.seek(t);
    await drawn();
  };
  Object.assign(window, { take, scene, ready: scene.ready.then(drawn) });
}

/** Waits until the page has been drawn. */
const drawn = (): Promise<void> => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())));
