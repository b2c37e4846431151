import type { Part, Shown } from "../app";
import type { Message } from "../core/connection";
import { g, type Joint } from "../core/kinematics";
import { h } from "../dom";
import type { Commands } from "./commands";

const RESTS = 0.2; // [s] after which a slider that is moved no more is meant
const HELD = 1; // [s] after a slider was moved in which it does not follow the arm
const FOLLOWS = 0.1; // [s] at least between two places of sliders that follow the arm
const MIN_CHANGE = 0.05; // [mm, deg] of a slider
const STEPS = [0.1, 0.5, 1, 2, 5, 10, 20, 50]; // [mm, deg] of a click
const SPEEDS = [1, 2, 5, 10, 20, 50]; // [%] of a button that is held: 50 % are 250 mm/s, the most by hand in ISO 10218-1 (T1)
const HOLD_AFTER = 0.25; // [s] after which a button is held, and not clicked
const SAID_EVERY = 0.1; // [s]: how often a button that is held says so
const FARTHER = 0.5; // [s] at full speed that each word of it leads
const AXES = {
  world: ["X", "Y", "Z", "RX", "RY", "RZ"],
  tool: ["TX", "TY", "TZ", "TRX", "TRY", "TRZ"],
};
type Frame = keyof typeof AXES | "joints";
const HINT = "Click: a step. Hold it down: the arm moves until it is let go";

/** Returns a joint's value in degrees, or mm of one that slides. */
const shown = (joint: Joint, x: number): number => (joint.kind === "prismatic" ? 1000 : 180 / Math.PI) * x;
const rounded = (x: number): number => Math.round(10 * x) / 10 + 0;
/** Writes a number as VAL-II has it, with two decimals at most. */
const plain = (x: number): string => String(Number(x.toFixed(2)) + 0);

/** A slider with a field: of a joint or the speed. `meant` is called when its user has set it and it rests. */
class Slider {
  readonly row: HTMLElement;
  readonly range: HTMLInputElement;
  private readonly field: HTMLInputElement;
  private wanted: number | null = null;
  private at = -Infinity;

  constructor(label: string, unit: string, min: number, max: number, step: number, private readonly meant: (value: number) => boolean) {
    const limits = { min: String(min), max: String(max), step: String(step) };
    this.range = h("input", { type: "range", class: "slider", "aria-label": `${label} [${unit}]`, ...limits });
    this.field = h("input", { type: "number", class: "field number", "aria-label": `${label}, exactly [${unit}]`, ...limits });
    this.range.addEventListener("input", () => this.moved(this.range));
    this.field.addEventListener("change", () => this.moved(this.field));
    this.row = h("div", { class: "slider-row" }, h("span", { class: "label", text: label }), this.range, this.field, h("span", { class: "note", text: unit }));
  }

  /** Forgets what was slid. */
  drop(): void {
    this.wanted = null;
    this.at = -Infinity;
  }

  follow(value: number): void {
    if (this.wanted !== null || performance.now() / 1000 < this.at + HELD) return;
    if (this.range.value !== String(value)) this.range.value = String(value);
    if (this.field.value !== String(value) && document.activeElement !== this.field) this.field.value = String(value);
  }

  private moved(by: HTMLInputElement): void {
    if (by.value === "" || !by.checkValidity()) return;
    const at = (this.at = performance.now() / 1000);
    this.wanted = Number(by.value);
    (by === this.range ? this.field : this.range).value = by.value;
    setTimeout(() => at === this.at && this.rest(), 1000 * RESTS);
  }

  private rest(): void {
    if (this.wanted === null) return;
    if (this.meant(this.wanted)) this.wanted = null;
    else setTimeout(() => this.rest(), 1000 * FOLLOWS); // where the motion before leads is not known yet
  }
}

/** Makes the tab in which the arm is moved by hand: SPEED, a slider for each joint, JOG along axes. */
export function makeMove(commands: Commands, slot: HTMLElement): Part | void {
  if (!commands.moves) return;
  const { connection, app } = commands;
  const model = connection.welcome!.model as unknown as Message;
  const joints = model.joints as (Joint & { max_velocity: number })[];
  const speed = new Slider("SPEED", "%", 1, 100, 1, (value) => (void commands.command(`SPEED ${plain(value)}`, "SPEED"), true));
  const sliders = joints.map((joint, i) => {
    const slides = joint.kind === "prismatic";
    return new Slider(`Joint ${i + 1}`, slides ? "mm" : "°", rounded(shown(joint, joint.lower)), rounded(shown(joint, joint.upper)), 0.1, (value) => turn(i, value));
  });
  /** Turns a joint to a value by a JOG from where it goes now; false while that is not known. */
  function turn(i: number, value: number): boolean {
    if (commands.waits("JOG")) return false;
    const { timeline } = app.source;
    const change = value - shown(joints[i], g(app.source.model, timeline, timeline.end)[i]);
    if (Math.abs(change) >= MIN_CHANGE) jog(String(i + 1), change);
    return true;
  }
  function jog(axis: string, amount: number): void {
    void commands.command(`JOG ${axis}, ${plain(amount)}`, `JOG ${axis}`);
  }

  // --- buttons that are held down ---

  let frame: Frame = "world";
  let told = "";
  let onWay = false;
  /** Leads the arm a little farther along an axis while a button is held. */
  async function press(index: number, sign: number): Promise<void> {
    if (onWay) return; // no faster than the arm answers: after the button is let go no earlier step follows
    const percent = Number(pace.value);
    const turns = frame !== "joints" && index >= 3;
    const full = frame === "joints" ? shown(joints[index], joints[index].max_velocity) : turns ? (180 / Math.PI) * model.tool.angular_speed : 1000 * model.tool.linear_speed;
    const amount = Math.round(sign * FARTHER * percent * 10 * full) / 1000;
    onWay = true;
    const end = await connection.ask("at", { act: { kind: "Press", axis: { frame, index }, amount, speed: percent } });
    onWay = false;
    const said: string = end.refusal?.message ?? end.found?.said ?? "";
    if (said && said !== told) commands.note(said, "warning");
    told = said;
  }
  async function letGo(): Promise<void> {
    told = "";
    const end = await connection.ask("at", { act: { kind: "Brake" } });
    commands.survey.happened();
    if (end.refusal) commands.note(end.refusal.message, "warning");
  }
  const drops = new Set<() => void>();
  function held(label: string, index: number, sign: number): HTMLElement {
    const name = frame === "joints" ? label : AXES[frame][index];
    const button = h("button", { class: "button jog", type: "button", text: sign < 0 ? "−" : "+", title: HINT, "aria-label": `${sign < 0 ? "minus" : "plus"} ${frame === "joints" ? "joint " : ""}${label}` });
    let timer = 0;
    let moving = false;
    let down = false;
    function begin(): void {
      if (down) return;
      down = true;
      timer = window.setTimeout(hold, 1000 * HOLD_AFTER);
    }
    function hold(): void {
      moving = true;
      void press(index, sign);
      timer = window.setTimeout(hold, 1000 * SAID_EVERY);
    }
    function end(step: boolean): void {
      if (!down) return;
      const moved = moving;
      drop();
      down = false;
      if (moved) void letGo();
      else if (step) jog(name, sign * Number(size.value));
    }
    /** Does nothing any more until the button is let go. */
    function drop(): void {
      clearTimeout(timer);
      moving = false;
    }
    const cut = (): void => {
      if (moving || timer) drop();
      if (down) down = false;
    };
    drops.add(cut);
    button.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      button.setPointerCapture(event.pointerId);
      begin();
    });
    button.addEventListener("pointerup", () => end(true));
    button.addEventListener("pointercancel", () => end(false));
    button.addEventListener("contextmenu", (event) => event.preventDefault()); // a finger that stays long
    button.addEventListener("keydown", (event) => {
      if (event.key !== " " && event.key !== "Enter") return;
      event.preventDefault();
      if (!event.repeat) begin();
    });
    button.addEventListener("keyup", (event) => (event.key === " " || event.key === "Enter") && end(true));
    button.addEventListener("blur", () => end(false));
    window.addEventListener("blur", () => end(false));
    document.addEventListener("visibilitychange", () => document.hidden && end(false));
    return button;
  }
  const options = (values: number[], chosen: number): HTMLElement[] =>
    values.map((value) => h("option", { value: String(value), text: String(value), selected: value === chosen }));
  const size = h("select", { class: "field" }, ...options(STEPS, 10));
  const pace = h("select", { class: "field" }, ...options(SPEEDS, 10));
  const frames = (["world", "tool", "joints"] as Frame[]).map((one) =>
    h("button", { class: "button", type: "button", text: one[0].toUpperCase() + one.slice(1), onclick: () => choose(one) }));
  const grid = h("div", { class: "jog-grid" });
  const grids = new Map<Frame, HTMLElement[]>();
  function choose(to: Frame): void {
    frame = to;
    frames.forEach((button, i) => button.setAttribute("aria-pressed", String((["world", "tool", "joints"] as Frame[])[i] === to)));
    const names = to === "joints" ? joints.map((_, i) => String(i + 1)) : AXES.world;
    if (!grids.has(to))
      grids.set(to, names.map((name, i) => h("div", { class: "jog-axis" }, held(name, i, -1), h("span", { class: "label", text: name }), held(name, i, 1))));
    grid.replaceChildren(...grids.get(to)!);
  }
  choose("world");
  const panel = h("div", { class: "stack move" }, speed.row, ...sliders.map((slider) => slider.row),
    h("div", { class: "row" }, h("span", { class: "label", text: "JOG" }), h("div", { class: "group", role: "group", "aria-label": "Axes of JOG" }, ...frames)),
    grid,
    h("div", { class: "row" }, h("label", { class: "label" }, "Click ", size, " mm, °"), h("label", { class: "label" }, "Hold ", pace, " %")),
    h("p", { class: "note", text: HINT }));
  const others = h("p", { class: "note", text: "Who drives moves the arm." });
  slot.append(panel, others);
  connection.on("state", () => {
    if (commands.open) return;
    [speed, ...sliders].forEach((slider) => slider.drop());
    drops.forEach((drop) => drop());
  });

  let followed = -Infinity;
  return {
    show({ now, timeline, surveyed, source }: Shown): void {
      panel.hidden = !commands.mayDrive;
      others.hidden = commands.mayDrive;
      const wall = performance.now() / 1000;
      if (wall < followed + FOLLOWS || !slot.offsetParent) return; // nobody sees it
      followed = wall;
      g(source.model, timeline, now).forEach((x, i) => sliders[i].follow(rounded(shown(joints[i], x))));
      if (surveyed) speed.follow(surveyed.monitor_speed);
    },
  };
}
