import "./style/style.css";
import "./style/replay.css";
import { makeLayout } from "./layout";
import { photograph, showRecording, type Recording } from "./recording";

const data = JSON.parse(document.getElementById("recording")!.textContent!) as Recording;
if (data.picture) photograph(data);
else showRecording(data, makeLayout());
