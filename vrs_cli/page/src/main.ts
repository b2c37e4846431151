import "./style/style.css";
import { App } from "./app";
import { makeClass, makeLesson } from "./class";
import { Connection } from "./core/connection";
import { LiveSource } from "./core/source";
import { Survey } from "./core/survey";
import { addressOf, bearer, exchangeToken, takeToken } from "./core/token";
import { h } from "./dom";
import { makeLayout } from "./layout";
import { makeScene, type Scene } from "./scene/scene";
import { makeBody } from "./panels/body";
import { Commands } from "./panels/commands";
import { makeDelays } from "./panels/delays";
import { makeDrag } from "./panels/drag";
import { makeHint } from "./panels/notice";
import { makeMove } from "./panels/move";
import { makePrograms } from "./panels/programs";
import { makePrompt } from "./panels/prompt";
import { makeSignals } from "./panels/signals";
import { makeDrives, makeQuestions, makeStop } from "./panels/stop";
import { Transcript, columnsOf } from "./panels/transcript";
import { makeViewing, showRecording, type Recording } from "./recording";
import "./style/driving.css";

const token = takeToken();
const name = decodeURIComponent(location.pathname.replace(/^\/view\//, ""));
const slot = makeLayout();
if (location.search === "?recording") void openRecording();
else openRobot();

/** Shows a served robot. */
function openRobot(): void {
  const connection = new Connection(addressOf(name), token, "browser", { columns: () => columnsOf(slot("output")) });
  new ResizeObserver(() => connection.resized()).observe(slot("output"));
  let model = "";
  connection.on("welcome", (welcome) => {
    void exchangeToken(name, token);
    const told = JSON.stringify(welcome.model);
    if (model && model !== told) location.reload(); // another robot has replaced it
    model = told;
  });
  makeClass(connection, slot);
  makeLesson(connection, slot);
  const closed = h("div", { class: "note bad banner", role: "alert" });
  const opening = h("div", { class: "note warn banner", role: "status", text: `Connecting to ${name} ...` });
  slot("notice").append(opening);
  const ends = [
    connection.on("closing", ({ refusal, why }) => (opening.remove(), tellClosed(refusal?.message ?? why, closed))),
    connection.on("change", () => {
      for (const end of ends) end();
      opening.remove();
      closed.remove();
      const app = new App(new LiveSource(connection), connection);
      const scene = makeScene(app, slot("canvas"));
      makeViewing(app, slot, scene);
      const commands = makeDriving(app, scene);
      makeHint(app, slot("hint"), (line) => commands.type(line));
      app.add(makeBody(commands, slot("delays")), makeDelays(app, slot("delays")));
      Object.assign(window, { app, scene, commands }); // for tests and the curious
    }),
  ];
}

/** Makes all panels that command the robot, except those that the user's role forbids. */
function makeDriving(app: App, scene: Scene): Commands {
  const connection = app.connection!;
  const survey = new Survey(connection, (found) => {
    app.surveyed = found;
    app.wake();
  });
  const transcript = new Transcript(slot("output"), `said ${connection.welcome!.robot}`);
  const commands = new Commands(app, connection, survey, transcript);
  commands.replied = (told) => told.sketch && scene.explain(told.sketch);
  commands.refused = async (text) => {
    if (text.includes("\n")) return;
    const end = await connection.ask("at", { act: { kind: "WhyRefused", text } });
    if (end.found) scene.explain(end.found); // why a typed motion was refused
  };
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

/** Shows a saved trajectory. */
async function openRecording(): Promise<void> {
  const answer = await fetch(`/recording/${encodeURIComponent(name)}.json`, { headers: bearer(token) });
  if (answer.ok) showRecording((await answer.json()) as Recording, slot);
  else tellClosed(await answer.text());
}

/** Says why there is nothing to show. */
function tellClosed(why: string, note = h("div", { class: "note bad banner", role: "alert" })): void {
  note.textContent = `${name} is not shown: ${why}`;
  slot("notice").append(note);
}
