import type { App } from "../app";
import { button, h } from "../dom";
import { icon } from "../style/icons";
import { remember, remembered } from "../core/storage";

/** A simple line that moves every robot. */
export const HINT = "DRIVE 1, 30, 50";

/** Makes the robot's name with the state of its connection, and notices: a cut, a role that may only watch, errors of the page. */
export function makeNotice(app: App, head: HTMLElement, slot: HTMLElement): void {
  const { connection, source } = app;
  const name = source.title;
  document.title = name;
  const lamp = h("span", { class: "lamp" });
  const state = h("span", { class: "state", role: "status" });
  head.append(h("div", { class: "robot" }, lamp, h("h1", { text: name, title: name }), state));
  const [cut, faults] = [0, 1].map(() => h("div", { class: "note bad banner", role: "alert", hidden: true }));
  slot.append(cut, faults);
  showFaults(faults);
  if (!connection) return void (state.textContent = "recording");
  let since = "";
  const show = (): void => {
    const role = connection.welcome?.role;
    const open = connection.state === "open";
    since = open ? "" : since || new Date().toLocaleTimeString();
    document.body.classList.toggle("cut", !open);
    document.title = open ? name : `${name} (not heard)`;
    lamp.className = `lamp ${open ? "good" : "bad"}`;
    state.textContent = open ? (role === "observer" ? "you may look" : "") : connection.state === "refused" ? "refused" : "not heard";
    cut.hidden = open;
    const why = connection.why ? ` (${connection.why})` : "";
    cut.textContent = connection.state === "refused"
      ? `The server refuses this page${why}.`
      : `${name} is not heard since ${since}${why}. What is shown from then on is what was planned. Connecting again ...`;
  };
  connection.on(["state", "welcome"], show);
  show();
}

/** Displays errors of the page itself, each once. */
function showFaults(box: HTMLElement): void {
  const tell = (error: unknown): void => {
    const text = error instanceof Error ? error.message : String(error);
    if (text.includes("ResizeObserver")) return;
    box.replaceChildren(h("span", { text: `Something is wrong in this page: ${text}. The robot goes on; loading the page again may help.` }),
      button(icon("close"), () => (box.hidden = true), { class: "icon quiet", "aria-label": "Close", title: "Close" }));
    box.hidden = false;
  };
  addEventListener("error", (event) => tell(event.error ?? event.message));
  addEventListener("unhandledrejection", (event) => tell(event.reason));
}

/** Makes a hint with one line to press, for users who have never moved a robot in this browser. `type` acts like Enter at the prompt. */
export function makeHint(app: App, slot: HTMLElement, type: (line: string) => void): void {
  if (remembered("used") || app.connection?.welcome?.role === "observer") return;
  const box = h("div", { class: "note hint" }, "Type a line of VAL-II, or begin with ",
    button(HINT, () => type(HINT), { class: "code" }), " (joint 1 by 30 at half speed).");
  const end = app.connection!.on("change", () => {
    if (app.source.timeline.segments.length < 2) return;
    remember("used", "yes");
    box.remove();
    end();
  });
  slot.append(box);
}
