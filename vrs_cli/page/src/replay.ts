import "./style/style.css";
import "./style/replay.css";
import { h } from "./dom";
import { makeLayout } from "./layout";
import { photograph, showRecording, type Recording } from "./recording";

const NAME = /^[\w.-]+$/;
const inline = (id: string): unknown => JSON.parse(document.getElementById(id)?.textContent ?? "null");

function begin(data: Recording): void {
  if (data.picture) photograph(data);
  else showRecording(data, makeLayout());
}

const recording = inline("recording") as Recording | null;
if (recording) begin(recording);
else {
  // the page for many recordings of a robot: replays/NAME.js calls `replay`
  const name = location.hash.slice(1);
  Object.assign(window, { replay: (moments: object) => begin({ ...(inline("robot") as object), ...moments } as Recording) });
  if (NAME.test(name)) document.body.append(h("script", { src: `replays/${name}.js` }));
}
