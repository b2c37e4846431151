import type { Part } from "../app";
import { Change } from "../core/change";
import type { Message } from "../core/connection";
import { jointUnits, type Model } from "../core/kinematics";
import type { Transform } from "../core/transform";
import { assign, button, choice, h, put } from "../dom";
import type { Gizmo } from "../scene/gizmo";
import type { Commands } from "./commands";

const MIN_PERIOD = 0.02; // [s] minimum time between two wishes
const REPEATED = 0.1; // [s] after which an unchanged wish is repeated, so that the robot knows that the user still holds the tool
const VISIBLE = 5e-4; // [m] minimum displayed distance between tool and wish

/** Says what keeps the tool from a wish, as `Hold.said` of vrs_cli/values/hand.py. */
export function heldText(held: Message | undefined, model: Model): string {
  const units = jointUnits(model);
  const said = ((held?.holds ?? []) as Message[]).map(({ limit, joint = 0, end, which = "" }) => {
    const { scale, unit, lower, upper } = units[Math.max(joint - 1, 0)];
    const value = `${(scale * (end === "lower" ? lower : upper)).toFixed(1)} ${unit === "°" ? "deg" : unit}`;
    const fast = `JT${joint} is as fast as it may be`;
    if (limit === "joint") return `JT${joint} is at its ${end} limit, ${value}`;
    if (limit === "reach") return `out of reach${which === "far" || which === "close" ? `: too ${which}` : ""}`;
    if (limit === "singularity") return `near the ${which} singularity${joint ? `: ${fast}` : ""}`;
    return limit === "contact" ? `it stops before a contact: ${which}` : fast;
  });
  const away = held?.away ?? 0;
  return said.join("; ") + (away >= VISIBLE ? ` (${(1000 * away).toFixed(0)} mm away)` : "");
}

/** Makes the tab in which the tool is dragged: the gizmo's axes, what holds the tool back, places and recording. */
export function makeDrag(commands: Commands, slot: HTMLElement, gizmo: Gizmo): Part | void {
  if (!commands.moves) return;
  const { connection, app } = commands;
  let wish: Transform | null = null;
  let sentAt = -Infinity;
  let timer = 0;
  let pulled: Message = {};

  function send(): void {
    clearTimeout(timer);
    sentAt = performance.now() / 1000;
    connection.send({ type: "drag", ...(wish ? { pose: [...wish] } : {}) });
    if (wish) timer = window.setTimeout(send, 1000 * REPEATED);
  }
  gizmo.onDrag = (to) => {
    if (!commands.open) return; // without a connection the tool is dropped
    const began = !wish && to;
    if (began) send(); // release a tool that a cut interrupted
    if (!to && wish) send(); // the last wish, before the release
    wish = to;
    const wait = sentAt + MIN_PERIOD - performance.now() / 1000;
    clearTimeout(timer);
    if (!to || began || wait <= 0) send();
    else timer = window.setTimeout(send, 1000 * wait);
  };
  const ours = (): boolean => ["", undefined, commands.name].includes(pulled.by);
  gizmo.enabled = () => on.checked && commands.mayDrive && ours() && (app.playback.following || gizmo.dragged);
  connection.on("pulled", ({ state }) => {
    if (state.why && pulled.by === commands.name) commands.note(`The tool is let go: ${state.why}`);
    pulled = state;
    app.wake();
  });
  connection.on("state", () => {
    if (commands.open) return;
    clearTimeout(timer);
    [wish, pulled] = [null, {}];
    gizmo.drop();
  });

  // --- the tab ---

  const on = h("input", { type: "checkbox", checked: true, onchange: () => app.wake() });
  const choose = <T extends string>(label: string, names: Record<T, string>, get: () => T, set: (to: T) => void): HTMLElement =>
    h("div", { class: "row" }, h("span", { class: "label", text: label }), choice(label, names, get, (to) => (set(to), app.wake())));
  const why = h("div", { class: "note drag-why", role: "status" });
  const name = h("input", { class: "field code", value: "part", "aria-label": "Name", autocomplete: "off" });
  const nameGiven = (): string => {
    if (!name.value.trim()) commands.note("A place or a program without a name: give it a name first", "error");
    return name.value.trim();
  };
  let began: number | null = null; // [s] when the recording began
  const record = button("", async () => {
    const given = nameGiven();
    if (!given) return;
    const begin = began;
    began = begin === null ? connection.now() : null;
    label();
    if (begin === null) return commands.note(`Recording ${given}: drag the tool, or move it in any other way`);
    const end = await commands.act({ kind: "RecordProgram", name: given, begin, end: connection.now() });
    if (end.found) commands.note(`${given} is in memory: EXECUTE ${given}, LISTP ${given}, STORE ${given}`);
  }, { title: "Of what is moved, under this name" });
  function label(): void {
    record.textContent = began === null ? "Record a program" : "End the program";
    record.setAttribute("aria-pressed", String(began !== null));
  }
  label();
  const here = button("HERE", () => {
    const given = nameGiven();
    if (given) void commands.command(`HERE ${given}`);
  }, { title: "Keep the place under this name" });
  const panel = h("div", { class: "stack drag" },
    h("label", { class: "switch", title: "Key G" }, on, "Arrows at the tool (G)"),
    choose("Axes", { tool: "Tool", world: "World" }, () => gizmo.axes, (to) => (gizmo.axes = to)),
    choose("Drag", { both: "Both", move: "Move", turn: "Turn" }, () => gizmo.motions, (to) => (gizmo.motions = to)),
    why,
    commands.supervises ? h("div", { class: "row" }, h("label", { class: "label" }, "Name ", name), here, record) : "");
  const others = h("p", { class: "note", text: "Who drives drags the tool." });
  slot.append(panel, others);
  window.addEventListener("keydown", (event) => {
    const typing = (event.target as HTMLElement).closest("input, textarea, select, [contenteditable]");
    if (event.key.toLowerCase() !== "g" || event.ctrlKey || event.metaKey || event.altKey || typing) return;
    on.checked = !on.checked;
    app.wake();
  });

  const change = new Change();
  return {
    show(): void {
      assign(panel, { hidden: !commands.mayDrive });
      assign(others, { hidden: commands.mayDrive });
      const held = app.playback.following || gizmo.dragged ? (pulled.held as Message | undefined) : undefined;
      const text = heldText(held, app.source.model);
      const joint = (held?.holds as Message[] | undefined)?.find(({ limit }) => limit === "joint")?.joint ?? 0;
      if (!change.to([text, joint, ours()])) return;
      gizmo.showHeld(text, joint);
      put(why, text || (ours() ? "The tool follows the arrows, as far as all limits let it." : "Somebody else drags the tool."));
    },
  };
}
