import { App } from "./app";
import type { Message } from "./core/connection";
import type { Model } from "./core/kinematics";
import type { Cell, Source } from "./core/source";
import { SnapshotRecord, Timeline } from "./core/timeline";
import { World, type ContactSpan, type CourseRows } from "./core/world";
import { h } from "./dom";
import type { Slot } from "./layout";
import { makeBar } from "./panels/bar";
import { makeCurves } from "./panels/curves";
import { makeKeys } from "./panels/keys";
import { makeNotice } from "./panels/notice";
import { makePose } from "./panels/pose";
import { makeCamera, makeShow } from "./panels/show";
import { makeStrip } from "./panels/strip";
import { makeScene, type Scene } from "./scene/scene";
import "./style/time.css";

const LONG = 300; // [s] of a longer timeline only a minute is shown at first

/** A saved trajectory, as `recorded_page` in vrs_cli/net/page_data.py writes it. */
export interface Recording {
  title: string;
  rate: number;
  model: Model;
  snapshot: SnapshotRecord;
  cell: Cell | null;
  world: { rows: CourseRows; touches: ContactSpan[] | null; until: number | null } | null;
  /** The locations that its motions name, with T_world_tool. */
  places: Message[];
  /** The span to play [s]; null: all. */
  between: [number, number] | null;
  /** The quality of photographs, 1 the finest, which show only the picture. 0: the whole page. */
  picture: number;
}

function appOf(data: Recording): App {
  const timeline = new Timeline();
  timeline.replace(data.snapshot);
  const world = data.world ? World.of(data.world.rows, data.world.touches, data.world.until) : new World();
  const { model, title, cell, between } = data;
  const source: Source = {
    model, timeline, title, cell, world, span: between ?? undefined, live: false, passes: false, now: () => timeline.end, onChange: () => {},
  };
  const app = new App(source, null);
  app.surveyed = { places: { more: 0, rows: data.places } };
  app.playback.rate = data.rate;
  return app;
}

/** Shows a recording in a layout, and plays it from the start. */
export function showRecording(data: Recording, slot: (name: Slot) => HTMLElement): void {
  const app = appOf(data);
  const scene = makeScene(app, slot("canvas"));
  makeViewing(app, slot, scene);
  app.playback.play();
  Object.assign(window, { app, scene }); // for tests and the curious
}

/** Makes all panels that show the robot and its time, for served robots and recordings. */
export function makeViewing(app: App, slot: (name: Slot) => HTMLElement, scene: Scene): void {
  const { playback } = app;
  const zoom = { seconds: app.connection && playback.end - playback.begin > LONG ? 60 : Infinity };
  makeNotice(app, slot("head"), slot("notice"));
  const bar = makeBar(app, slot("bar"), zoom);
  makeStrip(app, slot("strip"), zoom);
  makePose(app, slot("pose"), slot("canvas"));
  const curves = makeCurves(app, slot("curves"), zoom);
  const cameras = makeCamera(app, slot("camera"), scene.cameras);
  const show = makeShow(slot("show"), [{ heading: "In the picture", switches: scene.layers }, { heading: "Beside it", switches: curves }]);
  makeKeys([...bar, ...cameras, ...show], slot("show"));
}

/** Shows only the picture of a recording: `ready` resolves when it is complete, then `take` shows a time with a caption. */
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
