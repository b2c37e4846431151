import { assign, button, h, put } from "../dom";
import type { Commands } from "./commands";

const PATIENCE = 3; // [s] until STOP is said to have no answer
const [STOPPED_FOR, REFUSED_FOR] = [2, 8]; // [s] that the result is shown
const KEY = "."; // with Ctrl

/** Makes the button STOP: it brakes and stops all tasks, whoever drives, and says what became of it. */
export function makeStop(commands: Commands, slot: HTMLElement): void {
  if (!commands.moves) return;
  const note = h("div", { class: "note bad stop-said", role: "alert", hidden: true });
  const made = button("STOP", stop, { class: "danger stop", title: "Brake, and stop all programs (Ctrl + . or Pause)", "aria-keyshortcuts": "Control+. Pause" });
  slot.append(made, note);
  let result = "";
  let count = 0;
  function show(now = result, why = note.textContent!): void {
    result = now;
    put(note, why);
    assign(note, { hidden: !why });
    assign(made, { hidden: !(commands.supervises || commands.lease.driver === commands.name) }); // others are refused
    made.classList.toggle("lost", !commands.open);
    put(made, result || (commands.open ? "STOP" : "STOP: no connection"));
  }
  async function stop(): Promise<void> {
    const number = ++count;
    show("STOP ...", "");
    let why = "There is no connection: STOP did not reach the robot.";
    if (commands.open) {
      const patience = new Promise<null>((done) => setTimeout(done, 1000 * PATIENCE, null));
      const end = await Promise.race([commands.connection.ask("abort"), patience]);
      why = end ? (end.refusal?.message ?? "") : "STOP has no answer: the robot may move on.";
    }
    if (number !== count) return;
    show(why ? "NOT STOPPED" : "STOPPED", why);
    setTimeout(() => number === count && show("", ""), 1000 * (why ? REFUSED_FOR : STOPPED_FOR));
  }
  window.addEventListener("keydown", (event) => {
    if (made.hidden || !((event.ctrlKey && event.key === KEY) || event.key === "Pause")) return;
    event.preventDefault();
    event.stopPropagation();
    void stop();
  }, { capture: true });
  commands.connection.on("state", () => show(!commands.open && result === "STOPPED" ? "" : result));
  commands.onChange(() => show());
}
