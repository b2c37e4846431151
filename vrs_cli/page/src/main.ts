import "./style/style.css";
import { App } from "./app";
import { makeClass } from "./class";
import { Connection } from "./core/connection";
import { LiveSource } from "./core/source";
import { addressOf, exchangeToken, takeToken } from "./core/token";
import { makeLayout } from "./layout";
import { makeScene } from "./scene/scene";
import { makeDelays } from "./panels/delays";
import { makeDriving } from "./panels/driving";
import { makeHint } from "./panels/notice";
import { makeViewing } from "./panels/viewing";

const token = takeToken();
const robot = decodeURIComponent(location.pathname.replace(/^\/view\//, ""));
const slot = makeLayout();
const connection = new Connection(addressOf(robot), token, "browser");
connection.on("welcome", () => void exchangeToken(robot, token));
makeClass(connection, slot);
const end = connection.on("change", () => {
  end();
  const app = new App(new LiveSource(connection), connection);
  const scene = makeScene(app, slot("canvas"));
  makeViewing(app, slot, scene);
  const commands = makeDriving(app, slot, scene);
  makeHint(app, slot("hint"), (line) => commands.type(line));
  app.add(makeDelays(app, slot("delays")));
  Object.assign(window, { app, scene, commands }); // for tests and the curious
});
