import { h } from "../dom";
import type { Commands } from "./commands";

const PATIENCE = 3; // [s] until STOP is said to have no answer
const [STOPPED_FOR, REFUSED_FOR] = [2, 8]; // [s] that the result is shown
const KEY = "."; // with Ctrl

/** Makes the button STOP: it brakes and stops all tasks, whoever drives, and says what became of it. */
export function makeStop(commands: Commands, slot: HTMLElement): void {
  if (!commands.moves) return;
  const said = h("div", { class: "note bad stop-said", role: "alert", hidden: true });
  const button = h("button", {
    class: "button danger stop", type: "button", title: "Brake, and stop all programs (Ctrl + . or Pause)",
    "aria-keyshortcuts": "Control+. Pause", onclick: () => void stop(),
  });
  slot.append(button, said);
  let result = "";
  let count = 0;
  function show(): void {
    button.hidden = !(commands.supervises || commands.lease.driver === commands.name); // others are refused
    button.classList.toggle("lost", !commands.open);
    button.textContent = result || (commands.open ? "STOP" : "STOP: no connection");
  }
  async function stop(): Promise<void> {
    const number = ++count;
    result = "STOP ...";
    said.hidden = true;
    show();
    let why = "";
    if (!commands.open) why = "There is no connection: STOP did not reach the robot.";
    else {
      const patience = new Promise<null>((done) => setTimeout(done, 1000 * PATIENCE, null));
      const end = await Promise.race([commands.connection.ask("abort"), patience]);
      if (!end) why = "STOP has no answer: the robot may move on.";
      else if (end.refusal) why = end.refusal.message;
    }
    if (number !== count) return;
    result = why ? "NOT STOPPED" : "STOPPED";
    said.textContent = why;
    said.hidden = !why;
    show();
    setTimeout(() => {
      if (number !== count) return;
      result = "";
      said.hidden = true;
      show();
    }, 1000 * (why ? REFUSED_FOR : STOPPED_FOR));
  }
  window.addEventListener("keydown", (event) => {
    if (button.hidden || !((event.ctrlKey && event.key === KEY) || event.key === "Pause")) return;
    event.preventDefault();
    event.stopPropagation();
    void stop();
  }, { capture: true });
  commands.connection.on("state", () => {
    if (!commands.open && result === "STOPPED") result = "";
    show();
  });
  commands.onChange(show);
}
