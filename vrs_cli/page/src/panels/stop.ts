import { Change } from "../core/change";
import { assign, button, h, put } from "../dom";
import type { Commands } from "./commands";

const PATIENCE = 3; // [s] maximum wait for an answer to STOP
const [STOPPED_FOR, REFUSED_FOR] = [2, 8]; // [s] for which the result is shown
const KEY = "."; // with Ctrl
const NO_CONNECTION = "No connection to the robot: it is tried again";

/** Makes the row of the lease: who drives, buttons to request or give the lease, and the running command. */
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

/** Makes the box of questions of the robot (Y/N, Change?) and of programs (PROMPT), with buttons or a field. */
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

/** Makes the button STOP: it brakes and stops all tasks, whoever drives, and displays the result. */
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
    assign(made, { hidden: !(commands.supervises || commands.lease.driver === commands.name) }); // other users would be refused
    made.classList.toggle("lost", !commands.open);
    put(made, result || (commands.open ? "STOP" : "STOP: no connection"));
  }
  async function stop(): Promise<void> {
    const number = ++count;
    show("STOP ...", "");
    commands.stopped();
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
