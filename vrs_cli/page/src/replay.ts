import "./style/style.css";
import { makeLayout } from "./layout";
import { showRecording } from "./recording";

showRecording(JSON.parse(document.getElementById("recording")!.textContent!), makeLayout());
