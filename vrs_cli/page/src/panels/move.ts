import type { Part, Shown } from "../app";
import { Change } from "../core/change";
import type { Message } from "../core/connection";
import { DEGREES, g, jointUnits } from "../core/kinematics";
import { assign, choice, h } from "../dom";
import type { Commands } from "./commands";

const RESTS = 0.2; // [s] without motion after which the value of a slider counts
const HELD = 1; // [s] after a slider was moved before it follows the arm again
const FOLLOWS = 0.1; // [s] minimum time between two updates of sliders that follow the arm
const MIN_CHANGE = 0.05; // [mm, deg] minimum change of a slider
const STEPS = [0.1, 0.5, 1, 2, 5, 10, 20, 50]; // [mm, deg] of a click
const SPEEDS = [1, 2, 5, 10, 20, 50]; // [%] while a button is held: 50 % are 250 mm/s, the limit of ISO 10218-1 (T1)
const HOLD_AFTER = 0.25; // [s] after which a pressed button counts as held
const SAID_EVERY = 0.1; // [s] between two messages of a held button
const FARTHER = 0.5; // [s] of motion at full speed per message
const AXES = {
  world: ["X", "Y", "Z", "RX", "RY", "RZ"],
  tool: ["TX", "TY", "TZ", "TRX", "TRY", "TRZ"],
};
type Frame = keyof typeof AXES | "joints";
const HINT = "Click: a step. Hold it down: the arm moves until it is let go";

const rounded = (x: number): number => Math.round(10 * x) / 10 + 0;
/** Returns a number in VAL-II's form with at most two decimals. */
const plain = (x: number): string => String(Number(x.toFixed(2)) + 0);

/** A slider with a field, of a joint or the speed. `meant` is called when the user has set it and it rests. */
class Slider {
  readonly row: HTMLElement;
  private readonly range: HTMLInputElement;
  private readonly field: HTMLInputElement;
  private wanted: number | null = null;
  private at = -Infinity;

  constructor(label: string, unit: string, min: number, max: number, step: number, private readonly meant: (value: number) => boolean) {
    const limits = { min: String(min), max: String(max), step: String(step) };
    this.range = h("input", { type: "range", class: "slider", "aria-label": `${label} [${unit}]`, ...limits, oninput: () => this.moved(this.range) });
    this.field = h("input", { type: "number", class: "field number", "aria-label": `${label}, exactly [${unit}]`, ...limits, onchange: () => this.moved(this.field) });
    this.row = h("div", { class: "slider-row" }, h("span", { class: "label", text: label }), this.range, this.field, h("span", { class: "note", text: unit }));
  }

  /** Drops a value that is not sent yet. */
  drop(): void {
    [this.wanted, this.at] = [null, -Infinity];
  }

  /** Shows a value unless the user is setting one. */
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
    else setTimeout(() => this.rest(), 1000 * FOLLOWS); // the goal of the motion before is not known yet
  }
}

/** Has a button tell `again` while it is held down, by pointer or key, and `end` when it is let go: `held` if it was for so long.
 * Returns `lose`, for a button that is not seen any more, and `drop`: the robot is told nothing of a click, and with `all` of no button. */
function watchHold(button: HTMLElement, again: () => void, end: (held: boolean) => void): { lose: () => void; drop: (all: boolean) => void } {
  let timer = 0; // 0: not pressed
  let held = false;
  const repeat = (): void => {
    held = true;
    again();
    timer = window.setTimeout(repeat, 1000 * SAID_EVERY);
  };
  const press = (): unknown => (timer ||= window.setTimeout(repeat, 1000 * HOLD_AFTER));
  const letGo = (silently = false): void => {
    const [down, was] = [timer > 0, held];
    clearTimeout(timer);
    [timer, held] = [0, false];
    if (down && !silently) end(was);
  };
  const isKey = (event: KeyboardEvent): boolean => event.key === " " || event.key === "Enter";
  button.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    button.setPointerCapture(event.pointerId);
    press();
  });
  button.addEventListener("pointerup", () => letGo());
  button.addEventListener("contextmenu", (event) => event.preventDefault()); // a long touch opens a menu
  button.addEventListener("keydown", (event) => {
    if (!isKey(event)) return;
    event.preventDefault();
    if (!event.repeat) press();
  });
  button.addEventListener("keyup", (event) => isKey(event) && letGo());
  const lose = (): void => letGo(!held);
  for (const lost of ["pointercancel", "blur"]) button.addEventListener(lost, lose);
  return { lose, drop: (all) => void ((all || !held) && letGo(true)) };
}

/** Makes the tab in which the arm is moved by hand: SPEED, a slider for each joint, JOG along axes. */
export function makeMove(commands: Commands, slot: HTMLElement): Part | void {
  if (!commands.moves) return;
  const { connection, app } = commands;
  const model = connection.welcome!.model;
  const { linear_speed, angular_speed } = (model as unknown as Message).tool;
  const joints = jointUnits(model);
  const speed = new Slider("SPEED", "%", 1, 100, 1, (value) => (void commands.command(`SPEED ${plain(value)}`, "SPEED"), true));
  const sliders = joints.map(({ unit, scale, lower, upper }, i) =>
    new Slider(`Joint ${i + 1}`, unit, rounded(scale * lower), rounded(scale * upper), 0.1, (value) => turn(i, value)));
  /** Turns a joint to a value by a JOG from its current goal; returns false while that is unknown. */
  function turn(i: number, value: number): boolean {
    if (commands.waits("JOG")) return false;
    const { timeline } = app.source;
    const change = value - joints[i].scale * g(model, timeline, timeline.end)[i];
    if (Math.abs(change) >= MIN_CHANGE) jog(String(i + 1), change);
    return true;
  }
  const jog = (axis: string, amount: number): unknown => commands.command(`JOG ${axis}, ${plain(amount)}`, `JOG ${axis}`);

  // --- buttons that are held down ---

  let frame: Frame = "world";
  let told = "";
  let onWay = false;
  /** Moves the arm a little farther along an axis while a button is held. */
  async function press(index: number, sign: number): Promise<void> {
    if (onWay) return; // one step at a time, so that none follows the release of the button
    const percent = Number(pace.value);
    const full = frame === "joints" ? joints[index].scale * joints[index].limit : index >= 3 ? DEGREES * angular_speed : 1000 * linear_speed;
    const amount = Math.round(sign * FARTHER * percent * 10 * full) / 1000;
    onWay = true;
    const end = await connection.ask("at", { act: { kind: "Press", axis: { frame, index }, amount, speed: percent } });
    onWay = false;
    const said: string = end.refusal?.message ?? end.found?.said ?? "";
    if (said && said !== told) commands.note(said, "warning");
    told = said;
  }
  async function brake(): Promise<void> {
    told = "";
    const end = await connection.ask("at", { act: { kind: "Brake" } });
    commands.survey.happened();
    if (end.refusal) commands.note(end.refusal.message, "warning");
  }
  const buttons: ReturnType<typeof watchHold>[] = [];
  window.addEventListener("blur", () => buttons.forEach((one) => one.lose()));
  document.addEventListener("visibilitychange", () => document.hidden && buttons.forEach((one) => one.lose()));
  function jogButton(label: string, index: number, sign: number): HTMLElement {
    const name = frame === "joints" ? label : AXES[frame][index];
    const said = `${sign < 0 ? "minus" : "plus"} ${frame === "joints" ? "joint " : ""}${label}`;
    const button = h("button", { class: "button jog", type: "button", text: sign < 0 ? "−" : "+", title: HINT, "aria-label": said });
    buttons.push(watchHold(button, () => void press(index, sign), (held) => (held ? void brake() : jog(name, sign * Number(size.value)))));
    return button;
  }
  const select = (values: number[]): HTMLSelectElement =>
    h("select", { class: "field" }, ...values.map((value) => h("option", { value: String(value), text: String(value), selected: value === 10 })));
  const [size, pace] = [select(STEPS), select(SPEEDS)];
  const grid = h("div", { class: "jog-grid" });
  const grids = new Map<Frame, HTMLElement[]>();
  function choose(to: Frame): void {
    frame = to;
    const names = to === "joints" ? joints.map((_, i) => String(i + 1)) : AXES.world;
    const axis = (name: string, i: number): HTMLElement =>
      h("div", { class: "jog-axis" }, jogButton(name, i, -1), h("span", { class: "label", text: name }), jogButton(name, i, 1));
    if (!grids.has(to)) grids.set(to, names.map(axis));
    grid.replaceChildren(...grids.get(to)!);
  }
  choose("world");
  const panel = h("div", { class: "stack move" }, speed.row, ...sliders.map((slider) => slider.row),
    h("div", { class: "row" }, h("span", { class: "label", text: "JOG" }), choice<Frame>("Axes of JOG", { world: "World", tool: "Tool", joints: "Joints" }, () => frame, choose)),
    grid,
    h("div", { class: "row" }, h("label", { class: "label" }, "Click ", size, " mm, °"), h("label", { class: "label" }, "Hold ", pace, " %")),
    h("p", { class: "note", text: HINT }));
  const others = h("p", { class: "note", text: "Who drives moves the arm." });
  slot.append(panel, others);
  new ResizeObserver(() => app.wake()).observe(slot); // when the tab is opened
  commands.stopped = () => {
    [speed, ...sliders].forEach((slider) => slider.drop());
    buttons.forEach((button) => button.drop(!commands.open)); // of a button that is held the robot ends the press
  };
  connection.on("welcome", () => void connection.ask("at", { act: { kind: "Brake" } })); // lets go of a button held through a cut

  const change = new Change(1000 * FOLLOWS);
  return {
    show({ now, timeline, surveyed, source }: Shown): void {
      assign(panel, { hidden: !commands.mayDrive });
      assign(others, { hidden: commands.mayDrive });
      if (!slot.offsetParent || !change.to(`${performance.now()}`)) return; // the tab is hidden
      g(source.model, timeline, now).forEach((x, i) => sliders[i].follow(rounded(joints[i].scale * x)));
      if (surveyed) speed.follow(surveyed.monitor_speed);
    },
  };
}
