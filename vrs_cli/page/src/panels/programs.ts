import type { Part, Shown } from "../app";
import type { Message } from "../core/connection";
import { h } from "../dom";
import { type Commands, openTab } from "./commands";
import { ProgramEditor } from "./editor";
import { download, fileButton, loadFile, makeFiles } from "./files";

const NONE = "No program is in memory: type one, or load a file";

/** Makes the tab of programs: one in an editor with its present step, and what runs and stops it. */
export function makePrograms(commands: Commands, slot: HTMLElement): Part {
  const { survey, supervises } = commands;
  const choice = h("select", { class: "field", "aria-label": "Program", onchange: () => void choose(choice.value) });
  const state = h("div", { class: "note", role: "status" });
  const untrue = h("div", { class: "note bad", hidden: true });
  const editor = new ProgramEditor(commands, () => marked());
  editor.setWritable(supervises);
  const button = (label: string, title: string, act: () => void, style = ""): HTMLButtonElement =>
    h("button", { class: `button ${style}`, type: "button", text: label, title, onclick: act });
  const save = button("Save", "Store it in the robot's memory (Ctrl-S)", () => void editor.save());
  const revert = button("Revert", "Take back all that is not saved", () => void editor.revert());
  const pause = button("Pause", "", () => void commands.command(commands.status.pace?.paused ? "CLOCK GO" : "CLOCK PAUSE"));
  const keys = h("div", { class: "group", role: "group", "aria-label": "Run the program" },
    button("Run", "EXECUTE (Ctrl-Enter in the editor)", () => void run("EXECUTE"), "primary"),
    button("Step", "SSTEP: the next step (F10 in the editor)", () => void run("SSTEP")),
    button("Proceed", "PROCEED: go on where it stopped", () => void commands.command("PROCEED")),
    pause,
    button("Abort", "ABORT: stop the program and the motion", () => void commands.command("ABORT")));
  const edits = h("div", { class: "row" }, save, revert,
    button("New", "A new program", () => editor.create(fresh())),
    button("Delete", "DELETEP: delete it from the robot's memory", () => editor.name && void commands.command(`DELETEP ${editor.name}`)));
  const files = h("div", { class: "row" },
    fileButton("Load a file", ".v2,.pg,.lc,.txt,text/plain", (file) => void loadFile(commands, file)),
    button("Save as a file", "Save this program on this computer", () => editor.name && download(`${editor.name}.v2`, `${editor.text.trimEnd()}\n.END\n`)));
  slot.append(h("div", { class: "stack programs" }, h("div", { class: "row" }, choice, supervises ? edits : ""),
    supervises ? keys : "", state, untrue, editor.element, editor.message, files, supervises ? makeFiles(commands) : ""));
  if (!supervises) files.firstElementChild!.remove();

  let drawn = "";
  let mark = "";
  let followed = "";
  commands.see = (name, row) => {
    openTab("Programs");
    void choose(name, row);
  };
  editor.run = () => void run("EXECUTE");
  editor.step = () => void run("SSTEP");
  const [unsaved] = editor.unsaved;
  if (unsaved) void choose(unsaved);

  async function choose(name: string, row?: number): Promise<void> {
    survey.choose(name);
    mark = "";
    await editor.open(name, row);
    marked();
  }
  function fresh(): string {
    const names = new Set([...(survey.found?.programs?.rows ?? []).map((one: Message) => one.name), ...editor.unsaved]);
    for (let i = 1; ; i++) if (!names.has(`program${i}`)) return `program${i}`;
  }
  /** Runs or steps the program of the editor: saved first, where it was changed; a step goes on where it stands. */
  async function run(word: "EXECUTE" | "SSTEP"): Promise<void> {
    if (!editor.name) return commands.note(NONE);
    if (editor.dirty && !(await editor.save())) return;
    const task = survey.task;
    const stands = task && !task.running && task.step !== null && task.program.toLowerCase() === editor.name.toLowerCase();
    await commands.command(word === "SSTEP" && stands ? word : `${word} ${editor.name}`);
  }
  function marked(): void {
    const rows: Message[] = survey.found?.programs?.rows ?? [];
    const names = [...new Set([...rows.map((row) => row.name as string), ...editor.unsaved, ...(editor.name ? [editor.name] : [])])];
    const dirty = new Set(editor.dirty ? [editor.name, ...editor.unsaved] : editor.unsaved);
    const lines = names.map((name) => `${name}${dirty.has(name) ? " •" : ""}`);
    const text = JSON.stringify([lines, editor.name, editor.dirty]);
    if (text === drawn) return;
    drawn = text;
    choice.replaceChildren(...(names.length ? names.map((name, i) => h("option", { value: name, text: lines[i] })) : [h("option", { value: "", text: "(none in memory)" })]));
    choice.value = editor.name;
    choice.disabled = !names.length;
    save.disabled = revert.disabled = !editor.dirty;
    save.classList.toggle("primary", editor.dirty);
  }
  return {
    show({ surveyed }: Shown): void {
      if (!surveyed) return;
      const task = survey.task;
      keys.hidden = edits.hidden = !commands.mayDrive;
      const pace = commands.status.pace;
      pause.hidden = !pace;
      pause.textContent = pace?.paused ? "Go on" : "Pause";
      pause.title = pace?.paused ? "CLOCK GO: time goes on" : "CLOCK PAUSE: stop the clock, and with it the arm";
      const rows: Message[] = surveyed.programs?.rows ?? [];
      const wanted = task?.running && task.program !== followed ? task.program : editor.name || task?.program || rows[0]?.name;
      if (task?.running) followed = task.program;
      if (wanted && wanted.toLowerCase() !== editor.name.toLowerCase() && !editor.dirty && !editor.view.hasFocus) void choose(wanted);
      else if (editor.name && survey.chosen === editor.name && surveyed.marks[2] !== mark) {
        mark = surveyed.marks[2];
        void editor.look();
      }
      marked();
      const here = task && task.program.toLowerCase() === editor.name.toLowerCase() ? task.step : null;
      editor.show(here, !!task?.running, survey.chosen === editor.name ? (surveyed.breakpoints ?? []) : []);
      const where = task?.step ? `, step ${task.step}` : "";
      state.textContent = task ? `${task.program} ${task.state}${where}${task.asks ? `, asks: ${task.asks}` : ""}` : "";
      const readings: Message[] = surveyed.untrue ?? [];
      untrue.hidden = !readings.length;
      untrue.textContent = readings.map(untrueSentence).join("\n");
    },
  };
}

/** Says that what a program has read of a signal does not hold any more, as vrs_cli/render/displaced.py does. */
function untrueSentence({ signal, name, on, changed, command, time, place }: Message): string {
  const given = command ? `${command} was given` : "a program went on";
  const what = `${signal}${name ? ` (${name})` : ""} ${changed ? "came" : "was"} ${on ? "on" : "off"}`;
  return `${given} when ${what} at ${time.toFixed(3)} s; it no longer ${changed ? "does" : "is"}${place ? ` (${place})` : ""}`;
}
