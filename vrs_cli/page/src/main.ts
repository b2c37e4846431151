import "./style/style.css";
import { App } from "./app";
import { Connection } from "./core/connection";
import { LiveSource } from "./core/source";
import { makeLayout } from "./layout";
import { makeScene } from "./scene/scene";
import { makeDelays } from "./panels/delays";
import { makeDriving } from "./panels/driving";
import { makeHint } from "./panels/notice";
import { makeViewing } from "./panels/viewing";

const fragment = new URLSearchParams(location.hash.slice(1));
if (fragment.has("token")) {
  sessionStorage.setItem("token", fragment.get("token")!);
  history.replaceState(null, "", location.pathname + location.search); // the secret leaves the address
}
const robot = decodeURIComponent(location.pathname.replace(/^\/view\//, ""));
const scheme = location.protocol === "https:" ? "wss" : "ws";
const slot = makeLayout();
const connection = new Connection(
  `${scheme}://${location.host}/robots/${encodeURIComponent(robot)}`, sessionStorage.getItem("token") ?? "", "browser",
);
const end = connection.on("change", () => {
  end();
  const app = new App(new LiveSource(connection), connection);
  const scene = makeScene(app, slot("canvas"));
  makeViewing(app, slot, scene);
  const commands = makeDriving(app, slot, scene);
  makeHint(app, slot("hint"), (line) => commands.type(line));
  app.add(makeDelays(app, slot("delays")));
  Object.assign(window, { app, scene }); // for tests and the curious
});
