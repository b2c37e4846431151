import "./style/style.css";
import { App } from "./app";
import { makeClass } from "./class";
import { Connection } from "./core/connection";
import { LiveSource } from "./core/source";
import { addressOf, bearer, exchangeToken, takeToken } from "./core/token";
import { h } from "./dom";
import { makeLayout } from "./layout";
import { makeLesson } from "./lessons";
import { makeScene } from "./scene/scene";
import { makeBody } from "./panels/body";
import { makeDelays } from "./panels/delays";
import { makeDriving } from "./panels/driving";
import { makeHint } from "./panels/notice";
import { columnsOf } from "./panels/transcript";
import { makeViewing } from "./panels/viewing";
import { showRecording, type Recording } from "./recording";

const token = takeToken();
const name = decodeURIComponent(location.pathname.replace(/^\/view\//, ""));
const slot = makeLayout();
if (location.search === "?recording") void openRecording();
else openRobot();

/** Shows a robot that is served. */
function openRobot(): void {
  const connection = new Connection(addressOf(name), token, "browser", { columns: () => columnsOf(slot("output")) });
  new ResizeObserver(() => connection.resized()).observe(slot("output"));
  let model = "";
  connection.on("welcome", (welcome) => {
    void exchangeToken(name, token);
    const told = JSON.stringify(welcome.model);
    if (model && model !== told) location.reload(); // another robot is there now
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
      const commands = makeDriving(app, slot, scene);
      makeHint(app, slot("hint"), (line) => commands.type(line));
      app.add(makeBody(commands, slot("delays")), makeDelays(app, slot("delays")));
      Object.assign(window, { app, scene, commands }); // for tests and the curious
    }),
  ];
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
