import {
  acceptCompletion, autocompletion, closeCompletion, completionStatus, type CompletionContext, type CompletionResult,
  moveCompletionSelection, selectedCompletion, startCompletion,
} from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap } from "@codemirror/commands";
import { type Diagnostic, linter, setDiagnostics } from "@codemirror/lint";
import { EditorState, Prec } from "@codemirror/state";
import { EditorView, keymap, placeholder } from "@codemirror/view";
import type { Message } from "../core/connection";
import { assign, button, h } from "../dom";
import { Change } from "../core/change";
import type { Commands } from "./commands";
import { leadNote } from "./delays";
import { findingIn, valEditor } from "./language";

const MAX_SUGGESTIONS = 50;
const PATIENCE = 1; // [s] maximum wait for the check of a line before it is sent
const PAUSE = 0.15; // [s] without a key before a typed line is checked
const LEAD_PERIOD = 200; // [ms] between two updates of the remaining time
const STOPPING = /^\s*AB/i; // lines that are sent at once

/** Makes the line of VAL-II: history, completion, mistakes marked in place; a line with a mistake stays. */
export function makePrompt(commands: Commands, slot: HTMLElement): void {
  if (!commands.moves) return;
  const { connection } = commands;
  let at = 0; // number of the displayed line of the history, from the newest; 0: none
  let draft = ""; // the typed text before the history was opened
  let searching = false;
  let lines: string[] = []; // complete lines that are not sent yet
  let checking = false;
  let refused = { line: "", found: {} as Message }; // the last line that was not sent, with its mistake
  const mistake = h("div", { class: "note bad prompt-mistake", role: "status", hidden: true });
  const lead = h("div", { class: "note prompt-lead", hidden: true });
  const sign = h("span", { class: "prompt-sign code", "aria-hidden": "true" });

  const text = (): string => view.state.doc.toString();
  function put(to: string): void {
    view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: to }, selection: { anchor: to.length } });
  }

  // --- mistakes ---

  /** Displays a mistake, and returns its mark. */
  function said(found: Message): Diagnostic[] {
    const one: Diagnostic = { ...findingIn(view.state.doc, found), severity: "error" };
    mistake.hidden = false;
    mistake.textContent = one.message;
    return [one];
  }
  /** Finds mistakes in the line while it is typed, except in the unfinished word. */
  async function look(): Promise<Diagnostic[]> {
    const line = text();
    if (line && line === refused.line) return said(refused.found);
    if (!line.trim() || line.includes("\n") || !commands.open) return [];
    const found = (await connection.ask("check", { text: line })).mistake as Message | undefined;
    const typed = Math.min(view.state.selection.main.head, line.trimEnd().length);
    return found && text() === line && found.span.end <= typed ? said(found) : [];
  }

  // --- sending ---

  function enter(): boolean {
    const line = text();
    at = 0;
    searching = false;
    if (!line.trim() && !commands.status.in_program) return true;
    put("");
    if (STOPPING.test(line)) commands.type(line);
    else if (!commands.open) drop(line);
    else {
      lines.push(line);
      void next();
    }
    return true;
  }
  /** Sends complete lines one after the other; a line with a mistake returns to the field, and later ones are dropped. */
  async function next(): Promise<void> {
    if (checking) return;
    checking = true;
    for (let line = lines.shift(); line !== undefined; line = lines.shift()) {
      const patience = new Promise<Message>((done) => setTimeout(done, 1000 * PATIENCE, {}));
      const { mistake: found } = await Promise.race([connection.ask("check", { text: line }), patience]);
      if (found) {
        lines.splice(0).forEach((other) => commands.remember(other));
        if (!text()) put(line);
        refused = { line, found };
        const marks = said(found);
        if (text() === line) view.dispatch(setDiagnostics(view.state, marks));
      } else if (commands.open) commands.type(line);
      else drop(line);
    }
    checking = false;
  }
  /** Keeps an unsent line in the history. */
  function drop(line: string): void {
    commands.remember(line);
    commands.note(`Not given, for there is no connection to the robot: ${line.trim()}`, "warning");
  }

  // --- completion and history ---

  async function complete(context: CompletionContext): Promise<CompletionResult | null> {
    if (searching) return search();
    const line = context.state.doc.lineAt(context.pos);
    const before = line.text.slice(0, context.pos - line.from);
    if (!before.trim() && !context.explicit) return null;
    const { choices = [] } = await connection.ask("complete", { text: before, ...(context.explicit ? { everything: true } : {}) });
    return suggestions(choices, context.pos);
  }
  function search(): CompletionResult | null {
    const wanted = text().toLowerCase();
    const found = [...new Set([...commands.history].reverse())].filter((line) => line.toLowerCase().includes(wanted));
    if (!found.length) return null;
    const options = found.slice(0, MAX_SUGGESTIONS).map((line) => ({ label: line, displayLabel: line.split("\n")[0], apply: take }));
    return { from: 0, options, filter: false };
  }
  function take(_view: EditorView, { label }: { label: string }): void {
    searching = false;
    put(label);
  }
  function recall(by: 1 | -1): boolean {
    const to = Math.min(Math.max(at + by, 0), commands.history.length);
    if (to === at) return true;
    if (at === 0) draft = text();
    at = to;
    put(at ? commands.history[commands.history.length - at] : draft);
    return true;
  }
  /** Handles Up and Down: in an open menu, then in the rows of the text, then in the history. */
  const vertical = (by: 1 | -1) => (): boolean => {
    if (completionStatus(view.state) === "active" && (searching || by < 0 || selectedCompletion(view.state)))
      return moveCompletionSelection(by < 0)(view);
    const { number } = view.state.doc.lineAt(view.state.selection.main.head);
    if (number !== (by > 0 ? 1 : view.state.doc.lines)) return false;
    closeCompletion(view);
    return recall(by);
  };
  const keys = [
    { key: "Enter", run: () => (selectedCompletion(view.state) ? acceptCompletion(view) : enter()) },
    { key: "Shift-Enter", run: () => (view.dispatch(view.state.replaceSelection("\n")), true) },
    { key: "Tab", run: () => tab() },
    { key: "ArrowUp", run: vertical(1) },
    { key: "ArrowDown", run: vertical(-1) },
    { key: "Ctrl-r", run: () => ((searching = true), startCompletion(view)) },
    { key: "Ctrl-c", run: () => interrupt() },
    { key: "Escape", run: () => ((searching = false), closeCompletion(view) || ((mistake.hidden = true), false)) },
  ];
  /** Accepts the chosen suggestion, or the first one; leaves an empty line without suggestions. */
  function tab(): boolean {
    if (completionStatus(view.state) !== "active") return text().trim() ? startCompletion(view) : false;
    if (!selectedCompletion(view.state)) moveCompletionSelection(true)(view);
    return acceptCompletion(view) || true;
  }
  /** Handles Ctrl-C without a selection: drops the line, or the program that is being typed. */
  function interrupt(): boolean {
    if (!view.state.selection.main.empty) return false;
    if (text()) put("");
    else if (commands.status.in_program) void commands.act({ kind: "LeaveEntry" });
    else connection.send({ type: "interrupt" });
    return true;
  }

  const view = new EditorView({
    parent: h("div", { class: "prompt-line field" }),
    state: EditorState.create({
      extensions: [
        Prec.highest(keymap.of(keys)),
        history(), keymap.of([...historyKeymap, ...defaultKeymap]),
        autocompletion({ override: [complete], defaultKeymap: false, selectOnOpen: false, interactionDelay: 0, icons: false, maxRenderedOptions: MAX_SUGGESTIONS }),
        valEditor("A line of VAL-II", { enterkeyhint: "send" }), linter(look, { delay: 1000 * PAUSE }), EditorView.lineWrapping, placeholder("A line of VAL-II"),
        EditorView.updateListener.of((update) => {
          if (!update.docChanged) return;
          mistake.hidden = true;
          commands.app.wake();
          if (!text()) searching = false;
        }),
      ],
    }),
  });
  slot.append(
    h("div", { class: "prompt" }, sign, view.dom.parentElement!,
      button("Send", () => (enter(), view.focus()), { class: "primary", title: "Carry it out (Enter)" })),
    mistake, lead,
    h("div", { class: "row" },
      button("↑", () => (recall(1), view.focus()), { class: "quiet", title: "The line before (arrow up; Ctrl-R searches)" }),
      button("↓", () => (recall(-1), view.focus()), { class: "quiet", title: "The next line (arrow down)" }),
      button("Undo", () => commands.command("UNDO"), { class: "quiet", title: "Take back the last motion" }),
      button("Redo", () => commands.command("REDO"), { class: "quiet", title: "Do again what was taken back" })),
  );
  const read = new Change(LEAD_PERIOD, () => commands.app.wake());
  commands.app.add({
    show({ source: { preview } }) {
      const { arrival } = connection;
      const line = text();
      const found = arrival === null ? "" : leadNote(line, connection.now(), arrival, !!preview?.roundTrip);
      if (!read.to(line ? found : "")) return;
      lead.textContent = found;
      lead.hidden = !found;
      lead.classList.toggle("warn", found.startsWith("too late"));
    },
  });
  commands.onChange(() => {
    assign(sign, { textContent: commands.status.prompt?.trim() || "." });
  });
}

/** Returns choices of the robot as a menu at `pos`. */
export function suggestions(choices: Message[], pos: number): CompletionResult | null {
  if (!choices.length) return null;
  const length = Math.max(...choices.map((one) => one.length));
  const seen = new Map(choices.map((one) => [one.text, one]));
  const options = [...seen.values()].slice(0, MAX_SUGGESTIONS).map((one) => ({
    label: one.text as string,
    detail: one.meta?.replace(/^[^:]*: /, ""),
    apply: (view: EditorView, _option: unknown, _from: number, to: number) =>
      view.dispatch({
        changes: { from: pos - one.length, to, insert: one.text },
        selection: { anchor: pos - one.length + one.text.length },
        userEvent: "input.complete",
      }),
  }));
  return { from: pos - length, options, filter: false };
}
