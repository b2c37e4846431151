import type { Connection, Message } from "./core/connection";
import { leave, viewOf } from "./core/token";
import { button, h } from "./dom";
import type { Slot } from "./layout";
import "./style/class.css";

/** The state of a student, as `classstate` tells it. */
export interface Student {
  name: string;
  robots?: string[];
  here?: number;
  at?: string;
  help?: number | null;
  lesson?: string;
  step?: number;
  of?: number;
  handed_in?: string[];
}
export interface ClassState extends Message {
  frozen?: boolean;
  students?: Student[];
}

const SECONDS_SHOWN = 20; // of a notice that nobody has to answer

/** Returns why a request was refused, null where it was done. */
export function wrong(answer: Message): string | null {
  const { refusal } = answer;
  return refusal ? [refusal.detail || refusal.message, refusal.hint].filter(Boolean).join(": ") : null;
}

/** Returns how long ago something was, in words. `since`: seconds since 1970. */
export function ago(since: number): string {
  const minutes = Math.floor((Date.now() / 1000 - since) / 60);
  return minutes < 1 ? "just now" : `${minutes} min`;
}

/** Reads when a program was handed in: the name of its file begins with the time (UTC). */
export function handedInAt(file: string): Date | null {
  const found = /^(\d{4})(\d\d)(\d\d)-(\d\d)(\d\d)(\d\d)-/.exec(file);
  return found && new Date(Date.UTC(+found[1], +found[2] - 1, +found[3], +found[4], +found[5], +found[6]));
}

/** Makes what a student of a class has beside the robot: help, hand-in, what the teacher says. Elsewhere nothing is shown. */
export function makeClass(connection: Connection, slot: (name: Slot) => HTMLElement): void {
  const frozen = h("p", { class: "note warn class-note", role: "status", hidden: true, text: "Your teacher has stopped the class. What you typed is kept; nothing is done until it goes on." });
  const notices = h("div", { class: "stack class-notices", "aria-live": "assertive" });
  const help = button("Ask for help", async () => {
    const why = wrong(await connection.ask("askhelp", { wanted: help.getAttribute("aria-pressed") !== "true" }));
    if (why) notice(why, "bad");
  }, { "aria-pressed": "false" });
  const hand = button("Hand in", async () => {
    hand.disabled = true;
    const why = wrong(await connection.ask("handin", { name: connection.welcome?.robot ?? "" }));
    hand.disabled = false;
    notice(why ?? "Handed in. You may hand in again: the newest one counts.", why ? "bad" : "good");
  }, { title: "Give your teacher all your programs and variables, as they are now" });
  const out = button("Leave", async () => {
    connection.leave();
    await leave(robots);
    location.assign("/");
  }, { class: "quiet", title: "End here: this browser needs your link again" });
  const other = h("a", { class: "button" });
  const last = h("span", { class: "note class-last" });
  const bar = h("div", { class: "row class-bar", role: "group", "aria-label": "Class", hidden: true }, help, hand, other, last, out);
  slot("head").append(bar);
  slot("notice").append(frozen, notices);

  let robots: string[] = [];
  function notice(text: string, kind: "good" | "warn" | "bad", stays = false): void {
    const close = button("×", () => box.remove(), { class: "quiet icon", "aria-label": "Close this message" });
    const box = h("div", { class: `note ${kind} class-note row spread` }, h("span", { class: "class-text", text }), close);
    notices.append(box);
    if (!stays) setTimeout(() => box.remove(), 1000 * SECONDS_SHOWN);
  }

  connection.on("classstate", (state: ClassState) => {
    const own = state.students?.[0];
    if (!own || connection.welcome?.role === "teacher") return;
    bar.hidden = false;
    robots = own.robots ?? [];
    const [work, lessons] = robots;
    const learns = connection.welcome?.robot === lessons;
    other.hidden = !lessons;
    other.textContent = learns ? "My robot" : "Lessons";
    other.href = viewOf(learns ? work : lessons);
    frozen.hidden = !state.frozen;
    const asks = own.help != null;
    help.setAttribute("aria-pressed", String(asks));
    help.textContent = asks ? "Help is coming" : "Ask for help";
    help.title = `Your teacher sees that you ask${asks ? ". Press again if you need no help any more" : ""}`;
    const handed = handedInAt(own.handed_in?.at(-1) ?? "");
    last.textContent = handed ? `Handed in ${handed.toLocaleString([], { dateStyle: "short", timeStyle: "short" })}` : "";
  });
  connection.on("announced", ({ by, text }) => notice(`${by}: ${text}`, "warn", true));
}
