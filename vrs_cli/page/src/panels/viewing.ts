import type { App } from "../app";
import type { Slot } from "../layout";
import type { Scene } from "../scene/scene";
import "../style/time.css";
import { makeBar } from "./bar";
import { makeCurves } from "./curves";
import { makeKeys } from "./keys";
import { makeNotice } from "./notice";
import { makePose } from "./pose";
import { makeCamera, makeShow } from "./show";
import { makeStrip } from "./strip";

const LONG = 300; // [s]: of a robot that has been served for longer, a minute is shown at first

/** Makes all panels that show the robot and its time: for a robot that is served, and for a recording. */
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
