import { h } from "../dom";
import type { Commands } from "./commands";

/** Makes the place of questions: of the robot (Y/N, Change?) and of programs (PROMPT), with buttons or a field. */
export function makeQuestions(commands: Commands, slot: HTMLElement): void {
  if (!commands.moves) return;
  let shown = -1;
  commands.onChange(() => {
    const asked = commands.question;
    if ((asked?.number ?? -1) === shown) return;
    shown = asked?.number ?? -1;
    slot.replaceChildren();
    if (!asked) return;
    const { kind, about, wrong, text } = asked.question;
    const decides = kind === "Confirmation" || kind === "Parting";
    const said = [about, wrong, text].filter(Boolean).join(" ").trim() || "A line is wanted";
    const button = (label: string, style: string, act: () => void): HTMLElement =>
      h("button", { class: `button ${style}`, type: "button", text: label, onclick: act });
    const label = h("label", { class: "question-text", text: said });
    const answers = h("div", { class: "row" });
    slot.append(h("div", { class: "question note warn", role: "group", "aria-label": "A question" }, label, answers));
    const interrupt = button("Interrupt", "quiet", () => commands.answer(asked, null, "interrupted"));
    if (decides) {
      const yes = button("Yes", "primary", () => commands.answer(asked, true));
      answers.append(yes, button("No", "", () => commands.answer(asked, false)), interrupt);
      yes.focus();
      return;
    }
    const field = h("input", { class: "field code", id: `question-${asked.number}`, autocomplete: "off", "aria-label": said });
    label.htmlFor = field.id;
    const give = (): void => commands.answer(asked, field.value);
    field.addEventListener("keydown", (event) => event.key === "Enter" && give());
    answers.append(field, button("Answer", "primary", give), interrupt);
    field.focus();
  });
}
