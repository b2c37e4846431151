import type { App, Shown } from "../app";
import { Change } from "../core/change";
import type { Message } from "../core/connection";
import type { Timeline } from "../core/timeline";
import { PHASES, type Span, commandsIn, doingAt, roundStep, shares, spanOf } from "../core/spans";
import { assign, h } from "../dom";
import { colour, onTheme } from "../style/theme";
import { untrueSentence } from "./programs";

const [AXIS, BAND, NAMES] = [15, 18, 16]; // [px] heights of the numbers, the phases, and the names of commands
const DENSE = 3; // [px] closer commands are counted, not named
const BIN = 4; // [px] width of a column of counted commands
const MIN_NAME = 26; // [px] minimum room for a name
const REDRAW = 100; // [ms] minimum time between two drawings

/** Doubtful parts of a timeline: unconfirmed times, times displayed wrongly, and times of failed commands. */
interface Doubts {
  unconfirmed: number;
  flagged: [number, number][];
  late: { t: number; text: string }[];
  untrue: { t: number; text: string }[];
}

function doubtsOf({ source: { preview }, surveyed, now }: Shown): Doubts {
  return {
    unconfirmed: preview?.unconfirmed(now) ?? Infinity,
    flagged: preview?.flagged ?? [],
    late: (preview?.late ?? []).map((one) => ({ t: one.issued, text: `${one.text}: ${one.refused}` })),
    untrue: ((surveyed?.untrue ?? []) as Message[]).map((one) => ({ t: one.time, text: untrueSentence(one) })),
  };
}

/** Makes the strip of the timeline: phases by colour, commands by name, and doubtful parts. It also sets the displayed time. */
export function makeStrip(app: App, slot: HTMLElement, zoom: { seconds: number }): void {
  const canvas = h("canvas", { "aria-hidden": "true" });
  const [cursor, present] = [h("div", { class: "cursor" }), h("div", { class: "present" })];
  const tip = h("div", { class: "tip", hidden: true });
  const strip = h("div", { class: "strip", role: "slider", tabindex: "0", "aria-label": "Time", "aria-orientation": "horizontal" }, canvas, present, cursor);
  slot.append(strip, tip);
  let shown: Shown | null = null;
  let span: Span = { low: 0, high: 1 };
  let doubts: Doubts = { unconfirmed: Infinity, flagged: [], late: [], untrue: [] };
  let width = 1;
  let hovered: number | null = null;
  const place = (t: number): number => ((t - span.low) / (span.high - span.low)) * width;
  const timeAt = (x: number): number => span.low + (x / width) * (span.high - span.low);
  const drawn = new Change(REDRAW, () => app.wake()), told = new Change();
  const redraw = (): void => {
    width = Math.max(strip.clientWidth, 1);
    drawn.forget();
    app.wake();
  };
  new ResizeObserver(redraw).observe(strip);
  onTheme(redraw);

  // --- seeking ---
  const local = (event: PointerEvent): number => Math.min(Math.max(event.clientX - strip.getBoundingClientRect().left, 0), width);
  let dragging = false;
  strip.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    dragging = true;
    strip.setPointerCapture(event.pointerId);
    app.playback.seek(timeAt(local(event)));
  });
  strip.addEventListener("pointermove", (event) => {
    hovered = local(event);
    if (dragging) app.playback.seek(timeAt(hovered));
    showTip();
  });
  strip.addEventListener("lostpointercapture", () => (dragging = false));
  strip.addEventListener("pointerleave", () => {
    hovered = null;
    showTip();
  });
  for (const name of ["focus", "blur"]) strip.addEventListener(name, showTip);
  strip.addEventListener("keydown", (event) => {
    const by = (event.shiftKey ? 0.05 : 0.005) * (span.high - span.low);
    const to = { ArrowLeft: -by, ArrowDown: -by, ArrowRight: by, ArrowUp: by }[event.key];
    if (to === undefined || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    app.playback.seek(app.playback.time + to);
  });

  /** Describes the time under the pointer, or the displayed time if the strip has the keyboard. */
  function showTip(): void {
    const focused = strip.matches(":focus-visible");
    assign(tip, { hidden: !shown || (hovered === null && !focused) });
    if (tip.hidden || !shown) return;
    const x = hovered ?? place(Math.min(Math.max(shown.t, span.low), span.high));
    const near = (3 / width) * (span.high - span.low);
    const begins = commandsIn(shown.timeline, { low: timeAt(x) - near, high: timeAt(x) + near });
    const t = hovered !== null && begins.length === 1 && !dragging ? begins[0].t : timeAt(x);
    const doing = doingAt(shown.timeline, t);
    const lines = [`${t.toFixed(2)} s  ${doing.phase}`, begins.length > 1 ? `${begins.length} commands begin here, the first: ${begins[0].text}` : doing.text];
    if (t >= doubts.unconfirmed) lines.push("not confirmed by the robot");
    if (doubts.flagged.some(([begin, end]) => t >= begin - near && t <= end + near)) lines.push("something wrong was shown of this time");
    for (const one of [...doubts.late, ...doubts.untrue]) if (Math.abs(one.t - t) < 2 * near) lines.push(one.text);
    tip.replaceChildren(...lines.map((text) => h("div", { text })));
    const at = strip.getBoundingClientRect();
    const left = Math.min(Math.max(at.left + x - tip.offsetWidth / 2, 4), innerWidth - tip.offsetWidth - 4);
    tip.style.transform = `translate(${Math.round(left)}px, ${Math.round(at.top - tip.offsetHeight - 6)}px)`;
  }

  // --- each moment ---
  function show(now: Shown): void {
    shown = now;
    const { timeline, t } = now;
    span = spanOf(app.playback, zoom.seconds, t);
    doubts = doubtsOf(now);
    const { number, version, first, segments } = timeline;
    const key = [number, version, first, segments.length, span, Math.round(place(doubts.unconfirmed)), doubts.flagged, doubts.late, doubts.untrue];
    if (drawn.to(key)) draw(canvas, timeline, span, doubts, width);
    assign(cursor.style, { transform: `translateX(${place(Math.min(Math.max(t, span.low), span.high))}px)` });
    const hidden = app.playback.following || now.now < span.low || now.now > span.high;
    assign(present, { hidden });
    if (!hidden) assign(present.style, { transform: `translateX(${place(now.now)}px)` });
    const text = `${t.toFixed(1)} s, ${doingAt(timeline, t).text}`;
    if (!told.to(text)) return;
    Object.assign(strip, { ariaValueMin: span.low.toFixed(1), ariaValueMax: span.high.toFixed(1), ariaValueNow: t.toFixed(1), ariaValueText: text });
    if (!tip.hidden) showTip();
  }
  app.add({ show });
}

/** The drawing context of the strip: the pen, and the place of a time [px]. */
interface Sheet {
  pen: CanvasRenderingContext2D;
  span: Span;
  width: number;
  place(t: number): number;
}

function draw(canvas: HTMLCanvasElement, timeline: Timeline, span: Span, doubts: Doubts, width: number): void {
  const height = AXIS + BAND + NAMES;
  const ratio = devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  canvas.style.height = `${height}px`;
  const pen = canvas.getContext("2d")!;
  pen.scale(ratio, ratio);
  pen.font = `11px ${getComputedStyle(document.body).fontFamily}`;
  pen.textBaseline = "middle";
  const place = (t: number): number => ((t - span.low) / (span.high - span.low)) * width;
  const sheet = { pen, span, width, place };
  drawAxis(sheet);
  drawPhases(sheet, shares(timeline, span, canvas.width), 1 / ratio);
  drawDoubts(sheet, doubts);
  drawCommands(sheet, commandsIn(timeline, span));
  for (const [marks, property] of [[doubts.late, "--stop"], [doubts.untrue, "--warn"]] as const) {
    pen.fillStyle = colour(property);
    for (const { t } of marks) {
      const x = place(t);
      pen.fillRect(x - 1, AXIS - 3, 2, BAND + 6);
      pen.fill(new Path2D(`M${x - 4} ${AXIS - 6}h8l-4 7z`));
    }
  }
}

function drawAxis({ pen, span, width, place }: Sheet): void {
  const step = roundStep(span.high - span.low, Math.max(width / 70, 2));
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  pen.fillStyle = colour("--muted");
  for (let i = Math.ceil(span.low / step - 1e-9); i * step <= span.high + 1e-9; i++) {
    const text = `${(i * step).toFixed(digits)}${i * step >= span.high - 1e-9 ? " s" : ""}`;
    const half = pen.measureText(text).width / 2;
    const x = place(i * step);
    pen.textAlign = "center";
    pen.fillText(text, Math.min(Math.max(x, half), width - half), AXIS / 2 - 1);
    pen.fillRect(Math.min(x, width - 1), AXIS - 3, 1, 3);
  }
}

/** Fills each column with its phases, one above the other; columns with one equal phase are drawn as one piece. */
function drawPhases({ pen, width }: Sheet, found: Float32Array, column: number): void {
  pen.fillStyle = colour("--rest");
  pen.fillRect(0, AXIS, width, BAND);
  const n = PHASES.length;
  const columns = found.length / n;
  for (let phase = 1; phase < n; phase++) {
    pen.fillStyle = colour(`--${PHASES[phase]}`);
    for (let i = 0; i < columns; i++) {
      const share = found[i * n + phase];
      if (share < 0.01) continue;
      let below = 0;
      for (let other = 1; other < phase; other++) below += found[i * n + other];
      let run = 1;
      if (share > 0.99) while (i + run < columns && found[(i + run) * n + phase] > 0.99) run++;
      const bottom = AXIS + BAND * (1 - Math.min(below, 1));
      pen.fillRect(i * column, bottom - BAND * share, run * column, BAND * share);
      i += run - 1;
    }
  }
}

function drawDoubts({ pen, span, width, place }: Sheet, doubts: Doubts): void {
  const hatch = (from: number, to: number, property: string, sign: number): void => {
    pen.save();
    pen.beginPath();
    pen.rect(from, AXIS, Math.max(to - from, 3), BAND);
    pen.clip();
    pen.strokeStyle = colour(property);
    pen.lineWidth = 3;
    const first = sign > 0 ? AXIS + BAND : AXIS;
    for (let x = from - BAND - (from % 8); x < to + BAND; x += 8) pen.stroke(new Path2D(`M${x} ${first}l${BAND} ${-sign * BAND}`));
    pen.restore();
  };
  if (doubts.unconfirmed < span.high) hatch(Math.max(place(doubts.unconfirmed), 0), width, "--unconfirmed", 1);
  for (const [begin, end] of doubts.flagged) if (begin < span.high && end > span.low) hatch(Math.max(place(begin), 0), Math.min(place(end), width), "--stop", -1);
}

/** Marks the starts of commands, with names if there is room; counts them if they are too many. */
function drawCommands({ pen, width, place }: Sheet, commands: { t: number; text: string }[]): void {
  const top = AXIS + BAND;
  if (commands.length * DENSE > width) {
    const bins = new Uint32Array(Math.ceil(width / BIN));
    let most = 1;
    for (const { t } of commands) most = Math.max(most, ++bins[Math.min(Math.floor(place(t) / BIN), bins.length - 1)]);
    pen.fillStyle = colour("--muted");
    bins.forEach((count, i) => pen.fillRect(i * BIN, top + 2, BIN - 1, ((NAMES - 3) * count) / most));
    return;
  }
  pen.textAlign = "left";
  commands.forEach(({ t, text }, i) => {
    const x = Math.round(place(t));
    const room = (i + 1 < commands.length ? place(commands[i + 1].t) : width) - x - 7;
    pen.fillStyle = colour("--ink");
    pen.fillRect(x, AXIS, 1, BAND + 5);
    if (room < MIN_NAME && pen.measureText(text).width > room) return;
    pen.fillStyle = colour("--muted");
    pen.fillText(shortened(pen, text, room), x + 4, top + NAMES / 2 + 1);
  });
}

/** Returns a text, truncated with an ellipsis to fit the room [px]. */
function shortened(pen: CanvasRenderingContext2D, text: string, room: number): string {
  if (pen.measureText(text).width <= room) return text;
  let letters = Math.min(text.length - 1, Math.floor(room / 4));
  while (letters > 0 && pen.measureText(`${text.slice(0, letters)}…`).width > room) letters--;
  return letters ? `${text.slice(0, letters)}…` : "";
}
