import { acceptCompletion, autocompletion, type CompletionContext, type CompletionResult, completionKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap } from "@codemirror/commands";
import { type Diagnostic, lintKeymap, linter } from "@codemirror/lint";
import { search, searchKeymap } from "@codemirror/search";
import { EditorState, Prec, StateEffect } from "@codemirror/state";
import { Decoration, EditorView, GutterMarker, gutter, keymap, lineNumbers } from "@codemirror/view";
import { Change } from "../core/change";
import type { Message } from "../core/connection";
import { remember, rememberedValue } from "../core/storage";
import { button, h } from "../dom";
import type { Commands } from "./commands";
import { findingIn, marksField, valEditor } from "./language";
import { suggestions } from "./prompt";
import words from "./words.json";

const PAUSE = 0.4; // [s] without a key before the text is checked
const MAX_DRAFT_CHARS = 1_000_000; // maximum size of all stored drafts
const OPENS = /^\s*(?:\d+\s+)?(?:(?:FOR|WHILE|CASE|DO|ELSE|VALUE|ANY)\b|IF\b.*\bTHEN\s*(?:;.*)?$)/i;
const INDENT = 4;
const NAME = /[#$]?[a-z][\w.]*$/i;

const setStep = StateEffect.define<{ line: number; lit: boolean } | null>();
const setBreakpoints = StateEffect.define<number[]>();
const stepField = marksField(setStep, (step, doc) => {
  if (!step || step.line > doc.lines) return [];
  return [Decoration.line({ class: step.lit ? "step-lit" : "step-stands" }).range(doc.line(step.line).from)];
}, (field) => EditorView.decorations.from(field));
class Breakpoint extends GutterMarker {
  toDOM(): Node {
    return h("span", { class: "breakpoint", title: "It stops before this step" });
  }
}
const breakpoint = new Breakpoint();
const breakpointField = marksField<GutterMarker, number[]>(setBreakpoints, (lines, doc) =>
  lines.filter((line) => line <= doc.lines).map((line) => breakpoint.range(doc.line(line).from)));

/** A program as a text in an editor: its `.PROGRAM` line and one line a step, so that line n + 1 is step n. */
export class ProgramEditor {
  /** The edited program; "" for none. */
  name = "";
  /** Runs the edited program (Ctrl-Enter), or one step of it (F10). */
  run: () => void = () => {};
  step: () => void = () => {};
  readonly view: EditorView;
  readonly message = h("div", { class: "note editor-message", role: "status", hidden: true });
  private base = "";
  private readonly drafts: Record<string, { base: string; text: string }>; // `base`: the robot's text when editing began
  private timer = 0;
  private readonly drawn = new Change();
  private confirmed = ""; // the other program that the next Save may replace

  /** `changed` is called when unsaved changes appear or disappear. */
  constructor(private readonly commands: Commands, private readonly changed: () => void) {
    this.drafts = rememberedValue(this.draftsName, {});
    const keys = [
      { key: "Mod-s", run: () => (void this.save(), true) },
      { key: "Mod-Enter", run: () => (this.run(), true) },
      { key: "F10", run: () => (this.step(), true) },
      { key: "F9", run: () => this.toggle(this.view.state.doc.lineAt(this.view.state.selection.main.head).number) },
      { key: "Tab", run: acceptCompletion },
      { key: "Enter", run: () => this.newLine() },
    ];
    const domEventHandlers = {
      mousedown: (view: EditorView, block: { from: number }) => this.toggle(view.state.doc.lineAt(block.from).number),
    };
    const extensions = [
      keymap.of([...completionKeymap]), Prec.high(keymap.of(keys)),
      keymap.of([...historyKeymap, ...searchKeymap, ...lintKeymap, ...defaultKeymap]),
      history(), search({ top: true }), valEditor("The program"), stepField, breakpointField,
      autocompletion({ override: [(context) => this.complete(context)], icons: false, activateOnTypingDelay: 200 }),
      linter(() => this.find(), { delay: 1000 * PAUSE }),
      gutter({ class: "cm-breakpoints", markers: (view) => view.state.field(breakpointField), initialSpacer: () => breakpoint, domEventHandlers }),
      lineNumbers({ formatNumber: (line) => (line > 1 ? String(line - 1) : ""), domEventHandlers }),
      EditorView.updateListener.of((update) => update.docChanged && this.edited()),
      EditorState.readOnly.of(!this.commands.supervises),
    ];
    this.view = new EditorView({ state: EditorState.create({ extensions }), parent: h("div", { class: "editor" }) });
  }

  get element(): HTMLElement {
    return this.view.dom.parentElement!;
  }
  get text(): string {
    return this.view.state.doc.toString();
  }
  get dirty(): boolean {
    return this.text !== this.base;
  }
  /** The programs with unsaved changes, including closed ones. */
  get unsaved(): string[] {
    return Object.keys(this.drafts);
  }

  /** Opens a program of the robot, or its unsaved changes; the cursor in `row` (from 0). */
  async open(name: string, row?: number): Promise<void> {
    [this.name, this.base, this.confirmed] = [name, "", ""];
    this.drawn.forget();
    await this.look(true);
    if (row !== undefined && this.name === name) {
      const line = this.view.state.doc.line(Math.min(row + 1, this.view.state.doc.lines));
      this.view.dispatch({ selection: { anchor: line.to }, effects: EditorView.scrollIntoView(line.from, { y: "center" }) });
      this.view.focus();
    }
  }

  /** Opens a new program, which the robot does not have yet. */
  create(name: string): void {
    this.name = name;
    this.base = "";
    this.replace(`.PROGRAM ${name}()\n    `);
    this.view.dispatch({ selection: { anchor: this.view.state.doc.length } });
    this.view.focus();
  }

  /** Reads the robot's version of the program; unsaved changes stay. */
  async look(opening = false): Promise<void> {
    const name = this.name;
    const draft = this.drafts[name];
    const found = (await this.commands.connection.ask("at", { act: { kind: "LookAtProgram", program: name } })).found;
    if (name !== this.name) return;
    const there = (found?.text as string | undefined) ?? "";
    if (found && found.name !== name) this.name = found.name;
    if (opening && draft) {
      this.base = draft.base;
      this.replace(draft.text);
    } else if (opening || !this.dirty) {
      this.base = there;
      this.replace(there);
    }
    if (this.text === there) this.base = there;
    if (!found && !this.dirty) this.name = ""; // the program was deleted
    if (this.dirty && found && there !== this.base) {
      const take = button("Take the robot's", () => {
        this.base = there;
        this.replace(there);
        this.say("");
      });
      this.say(`${this.name} was changed at the robot meanwhile: Save replaces that.`, "warn", take);
    }
    this.keep();
  }

  /** Stores the program at the robot. Returns whether it is executable. */
  async save(): Promise<boolean> {
    const text = this.text.replace(/\n\s*\.END\s*$/i, "").trimEnd();
    const named = /^\s*\.PROGRAM\s+([\w.]+)/i.exec(text)?.[1].toLowerCase() ?? "";
    const others: string[] = (this.commands.survey.found?.programs?.rows ?? []).map((row: Message) => row.name.toLowerCase());
    if (named !== this.name.toLowerCase() && others.includes(named) && this.confirmed !== named) {
      this.confirmed = named;
      this.say(`The robot has another program ${named}: Save again replaces it.`, "warn");
      return false;
    }
    const sent = this.text;
    const end = await this.commands.act({ kind: "KeepDraft", text });
    if (!end.found) {
      this.say(end.refusal?.message ?? "It was not saved: there is no connection to the robot.", "bad");
      return false;
    }
    delete this.drafts[this.name];
    this.name = end.found.name;
    this.base = sent;
    this.confirmed = "";
    this.commands.note(end.found.said);
    this.say("");
    this.commands.survey.choose(this.name);
    await this.look();
    return !/cannot be executed/.test(end.found.said);
  }

  /** Shows the current step (line 1 is the heading), highlighted while the program runs, and the breakpoints. */
  show(step: number | null, lit: boolean, breakpoints: number[]): void {
    if (this.dirty || !this.drawn.to([step, lit, breakpoints, this.name, this.base.length])) return;
    const doc = this.view.state.doc;
    const effects: StateEffect<unknown>[] = [
      setStep.of(step === null ? null : { line: step + 1, lit }),
      setBreakpoints.of(breakpoints.map((one) => one + 1)),
    ];
    if (step !== null && step < doc.lines && !this.view.hasFocus) effects.push(EditorView.scrollIntoView(doc.line(step + 1).from, { y: "center" }));
    this.view.dispatch({ effects });
  }

  /** Reverts all unsaved changes. */
  revert(): void {
    this.replace(this.base);
    this.say("");
    void this.look();
  }

  private get draftsName(): string {
    return `drafts ${this.commands.connection.welcome!.robot}`;
  }

  private replace(text: string): void {
    const { head } = this.view.state.selection.main;
    if (text !== this.text)
      this.view.dispatch({ changes: { from: 0, to: this.view.state.doc.length, insert: text }, selection: { anchor: Math.min(head, text.length) } });
    this.drawn.forget();
    this.keep();
  }

  private edited(): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.keep(), 1000 * PAUSE);
    this.changed();
  }

  /** Stores unsaved changes, so that they survive a reload. */
  private keep(): void {
    if (this.dirty && this.name) this.drafts[this.name] = { base: this.base, text: this.text };
    else delete this.drafts[this.name];
    const kept = JSON.stringify(this.drafts);
    if (kept.length < MAX_DRAFT_CHARS && !remember(this.draftsName, kept))
      this.say("The browser has no room for unsaved changes: save them before the page is closed.", "warn");
    this.changed();
  }

  // --- mistakes ---

  /** Asks the robot for the mistakes in the text. */
  private async find(): Promise<Diagnostic[]> {
    const { text } = this;
    if (!this.commands.supervises || !text.trim()) return [];
    const end = await this.commands.connection.ask("at", { act: { kind: "ReadDraft", text: text.replace(/\n\s*\.END\s*$/i, "") } });
    if (text !== this.text) return [];
    const findings = (end.found?.findings ?? []) as Message[];
    const diagnostics = findings.map((one): Diagnostic & { step: number } => ({
      ...findingIn(this.view.state.doc, one), severity: one.severity === "error" ? "error" : "warning", step: one.span.line - 1,
    }));
    const first = diagnostics.find(({ severity }) => severity === "error") ?? diagnostics[0];
    if (first) this.say(`${first.step > 0 ? `Step ${first.step}: ` : ""}${first.message}`, first.severity === "error" ? "bad" : "warn");
    else if (!this.confirmed) this.say("");
    return diagnostics;
  }

  private say(text: string, style = "", ...more: Node[]): void {
    this.message.className = `note editor-message ${style}`;
    this.message.replaceChildren(text, ...more);
    this.message.hidden = !text;
  }

  // --- keys ---

  /** Sets or clears the breakpoint of a line. */
  private toggle(line: number): boolean {
    if (line < 2 || !this.commands.mayDrive || !this.commands.supervises) return false;
    if (this.dirty) {
      this.say("Save the program first: breakpoints are those of the robot's.", "warn");
      return true;
    }
    const from = this.view.state.doc.line(line).from;
    let set = false;
    this.view.state.field(breakpointField).between(from, from, () => void (set = true));
    void this.commands.command(`BPT ${this.name}, ${set ? 1 - line : line - 1}`, "BPT");
    return true;
  }

  private newLine(): boolean {
    const { state } = this.view;
    const line = state.doc.lineAt(state.selection.main.head);
    const indent = line.number === 1 ? INDENT : /^ */.exec(line.text)![0].length + (OPENS.test(line.text) ? INDENT : 0);
    this.view.dispatch(state.replaceSelection(`\n${" ".repeat(indent)}`), { scrollIntoView: true });
    return true;
  }

  /** Suggests words of a step: those of the robot (as after DO), of blocks, and the names of this text. */
  private async complete(context: CompletionContext): Promise<CompletionResult | null> {
    const line = context.state.doc.lineAt(context.pos);
    const before = line.text.slice(0, context.pos - line.from).trimStart();
    const begun = NAME.exec(before)?.[0] ?? "";
    if (line.number === 1 || (!begun && !context.explicit) || before.includes(";")) return null;
    const { choices = [] } = await this.commands.connection.ask("complete", { text: `DO ${before}` });
    const own = new Set([...(begun === before ? words.control : []), ...(this.text.match(/[#$]?\b[a-z][a-z0-9_.]*\b/g) ?? [])]);
    for (const name of own) {
      const begins = name.toLowerCase().startsWith(begun.toLowerCase()) && name !== begun;
      if (begins && !choices.some((one: Message) => one.text === name)) choices.push({ text: name, length: begun.length });
    }
    return suggestions(choices, context.pos);
  }
}
