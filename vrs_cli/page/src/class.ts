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

const WORDS = [
  ["Hint", "HINT", "Help with this step: first a nudge, then the idea, then the lines"],
  ["Again", "AGAIN", "Show the step again"],
  ["Skip", "SKIP", "Have the step done for you, and go on"],
  ["Back", "BACK", "One step back; the robot stays as it is"],
  ["All lessons", "LESSONS", "All lessons, and where you are. LESSON and a number goes to one"],
  ["Next lesson", "LESSON", "Go on with the next lesson"],
] as const;
const SECONDS_SHOWN = 20; // duration of a notice without an answer

/** Returns why a request was refused; null if it was done. */
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

/** Makes a student's controls in a class: help, hand-in, and messages of the teacher. Outside of a class nothing is shown. */
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

/** Makes the panel of a lesson above the transcript, if the robot has a lesson. */
export function makeLesson(connection: Connection, slot: (name: Slot) => HTMLElement): void {
  const title = h("h2", { class: "heading" });
  const text = h("div", { class: "lesson-text", tabindex: "0", role: "log", "aria-label": "The lesson", "aria-live": "polite" });
  const buttons = WORDS.map(([name, word, hint]) => button(name, () => connection.ask("line", { text: word }), { title: hint }));
  const next = buttons[buttons.length - 1];
  const panel = h("section", { class: "lesson", "aria-label": "Lesson", hidden: true }, title, text, h("div", { class: "row" }, ...buttons));
  slot("drives").closest(".talk")!.before(panel);
  let life = "";
  connection.on("welcome", (welcome) => {
    if (life && life !== welcome.life && !panel.hidden) location.reload(); // another lesson has another robot
    life = welcome.life as string;
  });
  connection.on("lessontext", ({ text: said, title: name, step, of }) => {
    panel.hidden = false;
    title.textContent = `${name}${of ? `: step ${step} of ${of}` : ""}`;
    next.hidden = !said.startsWith("That was the lesson");
    if (/^#{1,2} /.test(said)) text.replaceChildren(); // a new step
    const made = h("div", { class: "lesson-said" }, ...markdown(said));
    text.append(made);
    text.scrollTop = made.offsetTop - text.offsetTop;
  });
}

/** Makes elements of a text in the Markdown of lessons: headings, paragraphs, lists, code, **bold**. It is inserted as text only. */
export function markdown(text: string): HTMLElement[] {
  const found: HTMLElement[] = [];
  for (const block of text.replace(/^```.*\n([\s\S]*?)^```$/gm, (_, code: string) => code.replace(/^/gm, "    ")).split(/\n\s*\n/)) {
    const lines = block.replace(/^\n+|\s+$/g, "").split("\n");
    const heading = /^#+ +(.*)$/.exec(lines[0]);
    if (heading) {
      found.push(h("h3", { class: "lesson-heading" }, ...runs(heading[1])));
      lines.shift();
    }
    if (!lines.length || !lines[0]) continue;
    if (lines.every((line) => line.startsWith("    "))) {
      const [last, code] = [found.at(-1), lines.map((line) => line.slice(4)).join("\n")];
      if (last?.tagName === "PRE") last.textContent += `\n${code}`;
      else found.push(h("pre", { class: "code lesson-code", text: code }));
    } else if (/^([-*]|\d+\.) /.test(lines[0])) {
      const items: string[] = [];
      for (const line of lines) {
        if (/^([-*]|\d+\.) /.test(line)) items.push(line.replace(/^([-*]|\d+\.) +/, ""));
        else items.push(`${items.pop()} ${line.trim()}`);
      }
      found.push(h("ul", { class: "lesson-list" }, ...items.map((item) => h("li", {}, ...runs(item)))));
    } else found.push(h("p", {}, ...runs(lines.join(" "))));
  }
  return found;
}

function runs(text: string): (Node | string)[] {
  return text.split(/(`[^`]+`|\*\*[^*]+\*\*)/).filter(Boolean).map((part) =>
    part.startsWith("`") && part.length > 2 ? h("code", { class: "code", text: part.slice(1, -1) })
      : part.startsWith("**") && part.length > 4 ? h("strong", { text: part.slice(2, -2) }) : part);
}
