import { Change } from "../core/change";
import { button, h } from "../dom";
import type { Commands } from "./commands";

const NO_CONNECTION = "No connection to the robot: it is tried again";

/** Makes the row that says who drives, and lets this user ask for it or give it; and what is under way. */
export function makeDrives(commands: Commands, slot: HTMLElement): void {
  const offer = (label: string, act: string, to = ""): HTMLElement => button(label, () => commands.drive(act, to));
  const row = h("div", { class: "row spread drives", role: "status" });
  const change = new Change();
  commands.onChange(() => {
    const { lease, name, open } = commands;
    const alone = commands.connection.welcome!.one_user && !lease.driver;
    const under = commands.underWay;
    const said = !open ? NO_CONNECTION : under ? `Under way: ${under.split("\n")[0].slice(0, 60)}` : "";
    if (!change.to([lease, name, open, alone, said])) return;
    const buttons: HTMLElement[] = [];
    if (commands.moves && open && !alone) {
      if (!lease.driver) buttons.push(offer("Drive", "acquire"));
      else if (lease.driver !== name) buttons.push(offer("Ask to drive", "ask"));
      else {
        if (lease.asking) buttons.push(offer(`Give to ${lease.asking}`, "give", lease.asking));
        buttons.push(offer("Let others drive", "release"));
      }
    }
    const news = h("span", { class: `note drives-news ${open ? "" : "bad"}`, text: said });
    row.replaceChildren(h("span", {}, alone ? "" : commands.whoDrives(), " ", news), h("span", { class: "row" }, ...buttons));
    slot.replaceChildren(...(row.textContent?.trim() ? [row] : []));
  });
}

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
