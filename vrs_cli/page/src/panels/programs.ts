import type { Part, Shown } from "../app";
import { Change } from "../core/change";
import type { Message } from "../core/connection";
import { assign, button, group, h, put } from "../dom";
import { type Commands, openTab } from "./commands";
import { ProgramEditor } from "./editor";
import { download, fileButton, loadFile, makeFiles } from "./files";

const NONE = "No program is in memory: type one, or load a file";

/** Makes the tab of programs: an editor with the current step, and buttons to run and stop. */
export function makePrograms(commands: Commands, slot: HTMLElement): Part {
  const { survey, supervises } = commands;
  const choice = h("select", { class: "field", "aria-label": "Program", onchange: () => void choose(choice.value) });
  const state = h("div", { class: "note", role: "status" });
  const untrue = h("div", { class: "note bad", hidden: true });
  const editor = new ProgramEditor(commands, () => marked());
  const command = (line: string): void => void commands.command(line);
  const save = button("Save", () => editor.save(), { title: "Store it in the robot's memory (Ctrl-S)" });
  const revert = button("Revert", () => editor.revert(), { title: "Take back all that is not saved" });
  const pause = button("Pause", () => command(commands.status.pace?.paused ? "CLOCK GO" : "CLOCK PAUSE"));
  const keys = group("Run the program",
    button("Run", () => run("EXECUTE"), { class: "primary", title: "EXECUTE (Ctrl-Enter in the editor)" }),
    button("Step", () => run("SSTEP"), { title: "SSTEP: the next step (F10 in the editor)" }),
    button("Proceed", () => command("PROCEED"), { title: "PROCEED: go on where it stopped" }),
    pause,
    button("Abort", () => command("ABORT"), { title: "ABORT: stop the program and the motion" }));
  const edits = h("div", { class: "row" }, save, revert,
    button("New", () => editor.create(fresh()), { title: "A new program" }),
    button("Delete", () => editor.name && command(`DELETEP ${editor.name}`), { title: "DELETEP: delete it from the robot's memory" }));
  const load = fileButton("Load a file", ".v2,.pg,.lc,.txt,text/plain", (file) => loadFile(commands, file), (why) => commands.note(why, "error"));
  const saveAs = button("Save as a file", () => editor.name && download(`${editor.name}.v2`, `${editor.text.trimEnd()}\n.END\n`), { title: "Save this program on this computer" });
  slot.append(h("div", { class: "stack programs" }, h("div", { class: "row" }, choice, supervises ? edits : ""),
    supervises ? keys : "", state, untrue, editor.element, editor.message, h("div", { class: "row" }, supervises ? load : "", saveAs),
    supervises ? makeFiles(commands) : ""));

  let mark = "";
  let followed = "";
  const change = new Change();
  commands.see = (name, row) => {
    openTab("Programs");
    void choose(name, row);
  };
  editor.run = () => void run("EXECUTE");
  editor.step = () => void run("SSTEP");
  const [unsaved] = editor.unsaved;
  if (unsaved) void choose(unsaved);

  const rowsOf = (surveyed: Message | null): Message[] => surveyed?.programs?.rows ?? [];
  const isOpen = (program: string): boolean => program.toLowerCase() === editor.name.toLowerCase();
  async function choose(name: string, row?: number): Promise<void> {
    survey.choose(name);
    mark = "";
    await editor.open(name, row);
    marked();
  }
  function fresh(): string {
    const names = new Set([...rowsOf(survey.found).map(({ name }) => name), ...editor.unsaved]);
    for (let i = 1; ; i++) if (!names.has(`program${i}`)) return `program${i}`;
  }
  /** Runs or steps the program of the editor, after saving changes; a step continues at the current one. */
  async function run(word: "EXECUTE" | "SSTEP"): Promise<void> {
    if (!editor.name) return commands.note(NONE);
    if (editor.dirty && !(await editor.save())) return;
    const task = survey.task;
    const stands = task && !task.running && task.step !== null && isOpen(task.program);
    command(word === "SSTEP" && stands ? word : `${word} ${editor.name}`);
  }
  /** Lists the programs, and marks those with changes. */
  function marked(): void {
    const names = [...new Set([...rowsOf(survey.found).map(({ name }) => name as string), ...editor.unsaved, editor.name])].filter(Boolean);
    const dirty = new Set([...editor.unsaved, editor.dirty ? editor.name : ""]);
    const lines = names.map((name) => `${name}${dirty.has(name) ? " •" : ""}`);
    if (!change.to([lines, editor.name, editor.dirty])) return;
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
      for (const one of [keys, edits]) assign(one, { hidden: !commands.mayDrive });
      const pace = commands.status.pace;
      put(pause, pace?.paused ? "Go on" : "Pause");
      assign(pause, { hidden: !pace, title: pace?.paused ? "CLOCK GO: time goes on" : "CLOCK PAUSE: stop the clock, and with it the arm" });
      const wanted = task?.running && task.program !== followed ? task.program : editor.name || task?.program || rowsOf(surveyed)[0]?.name;
      if (task?.running) followed = task.program;
      if (wanted && !isOpen(wanted) && !editor.dirty && !editor.view.hasFocus) void choose(wanted);
      else if (editor.name && survey.chosen === editor.name && surveyed.marks[2] !== mark) {
        mark = surveyed.marks[2];
        void editor.look();
      }
      marked();
      const here = task && isOpen(task.program) ? task.step : null;
      editor.show(here, !!task?.running, survey.chosen === editor.name ? (surveyed.breakpoints ?? []) : []);
      const where = task?.step ? `, step ${task.step}` : "";
      put(state, task ? `${task.program} ${task.state}${where}${task.asks ? `, asks: ${task.asks}` : ""}` : "");
      const readings: Message[] = surveyed.untrue ?? [];
      assign(untrue, { hidden: !readings.length });
      put(untrue, readings.map((one) => untrueSentence(one, ` at ${one.time.toFixed(3)} s`)).join("\n"));
    },
  };
}

/** Says that a signal no longer has the value that a program read, as vrs_cli/render/displaced.py does. `at`: the time [s]. */
export function untrueSentence({ signal, name, on, changed, command, place }: Message, at = ""): string {
  const given = command ? `${command} was given` : "a program went on";
  const what = `${signal}${name ? ` (${name})` : ""} ${changed ? "came" : "was"} ${on ? "on" : "off"}`;
  return `${given} when ${what}${at}; it no longer ${changed ? "does" : "is"}${place ? ` (${place})` : ""}`;
}
