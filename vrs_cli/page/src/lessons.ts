import type { Connection } from "./core/connection";
import { button, h } from "./dom";
import type { Slot } from "./layout";

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

/** Makes elements of a text in the Markdown of lessons: headings, paragraphs, lists, code, **bold**. It goes in as text alone. */
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
