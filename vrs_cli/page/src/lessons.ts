import type { Connection } from "./core/connection";
import { button, h } from "./dom";
import type { Slot } from "./layout";
import { markdown } from "./markdown";

const WORDS = [
  ["Hint", "HINT", "Help with this step: first a nudge, then the idea, then the lines"],
  ["Again", "AGAIN", "Show the step again"],
  ["Skip", "SKIP", "Have the step done for you, and go on"],
  ["Back", "BACK", "One step back; the robot stays as it is"],
  ["All lessons", "LESSONS", "All lessons, and where you are. LESSON and a number goes to one"],
  ["Next lesson", "LESSON", "Go on with the next lesson"],
] as const;

/** Makes the panel of a lesson above what was said, at a robot that has one. */
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
