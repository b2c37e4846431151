import type { App } from "../app";
import { Survey } from "../core/survey";
import type { Slot } from "../layout";
import type { Scene } from "../scene/scene";
import "../style/driving.css";
import { Commands } from "./commands";
import { makeDrag } from "./drag";
import { makeMove } from "./move";
import { makePrograms } from "./programs";
import { makePrompt } from "./prompt";
import { makeSignals } from "./signals";
import { makeStop } from "./stop";
import { makeDrives, makeQuestions } from "./talk";
import { Transcript } from "./transcript";

/** Makes all panels that command the robot; those that the role of this user forbids are not there. */
export function makeDriving(app: App, slot: (name: Slot) => HTMLElement, scene: Scene): Commands {
  const connection = app.connection!;
  const survey = new Survey(connection, (found) => {
    app.surveyed = found;
    app.wake();
  });
  const transcript = new Transcript(slot("output"), `said ${connection.welcome!.robot}`);
  const commands = new Commands(app, connection, survey, transcript);
  commands.replied = (told) => told.sketch && scene.explain(told.sketch);
  commands.refused = (text) => void explainRefused(commands, scene, text);
  makeStop(commands, slot("stop"));
  makeDrives(commands, slot("drives"));
  makeQuestions(commands, slot("questions"));
  makePrompt(commands, slot("prompt"));
  app.add(
    makePrograms(commands, slot("tab:Programs")), makeMove(commands, slot("tab:Move")),
    makeDrag(commands, slot("tab:Drag"), scene.gizmo), makeSignals(commands, slot("tab:Signals")),
  );
  return commands;
}

/** Draws why a motion that was typed is refused. */
async function explainRefused(commands: Commands, scene: Scene, text: string): Promise<void> {
  if (text.includes("\n")) return;
  const end = await commands.connection.ask("at", { act: { kind: "WhyRefused", text } });
  if (end.found) scene.explain(end.found);
}
