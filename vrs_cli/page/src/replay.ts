import "./style/style.css";
import { App } from "./app";
import { RecordedSource } from "./core/source";
import { Timeline } from "./core/timeline";
import { makeLayout } from "./layout";
import { makeScene } from "./scene/scene";
import { makeViewing } from "./panels/viewing";

const data = JSON.parse(document.getElementById("recording")!.textContent!);
const timeline = new Timeline();
timeline.replace(data.snapshot);
const app = new App(new RecordedSource(data.model, timeline, data.title ?? ""), null);
const slot = makeLayout();
makeViewing(app, slot, makeScene(app, slot("canvas")));
app.playback.play();
