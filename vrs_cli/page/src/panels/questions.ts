import { Change } from "../core/change";
import { button, h } from "../dom";
import type { Commands } from "./commands";

/** Makes the place of questions: of the robot (Y/N, Change?) and of programs (PROMPT), with buttons or a field. */
export function makeQuestions(commands: Commands, slot: HTMLElement): void {
  if (!commands.moves) return;
  const change = new Change();
  commands.onChange(() => {
    const asked = commands.question;
    if (!change.to([asked?.number])) return;
    slot.replaceChildren();
    if (!asked) return;
    const { kind, about, wrong, text } = asked.question;
    const said = [about, wrong, text].filter(Boolean).join(" ").trim() || "A line is wanted";
    const label = h("label", { class: "question-text", text: said });
    const answers = h("div", { class: "row" });
    slot.append(h("div", { class: "question note warn", role: "group", "aria-label": "A question" }, label, answers));
    const interrupt = button("Interrupt", () => commands.answer(asked, null, "interrupted"), { class: "quiet" });
    if (kind === "Confirmation" || kind === "Parting") {
      const yes = button("Yes", () => commands.answer(asked, true), { class: "primary" });
      answers.append(yes, button("No", () => commands.answer(asked, false)), interrupt);
      return yes.focus();
    }
    const field = h("input", { class: "field code", id: `question-${asked.number}`, autocomplete: "off", "aria-label": said });
    label.htmlFor = field.id;
    const give = (): void => commands.answer(asked, field.value);
    field.addEventListener("keydown", (event) => event.key === "Enter" && give());
    answers.append(field, button("Answer", give, { class: "primary" }), interrupt);
    field.focus();
  });
}
