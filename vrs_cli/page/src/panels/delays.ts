import type { App, Part, Shown } from "../app";
import { Change } from "../core/change";
import type { Ahead, Preview } from "../core/preview";
import { assign, h } from "../dom";

const PRESENT = "at its present";
const HEARD = "as it is heard, with a prediction";
const PERIOD = 100; // [ms] minimum time between two texts, so that they stay readable

/** Makes the panel of delays: the displayed time, and what is uncertain. It appears with the first delay. */
export function makeDelays(app: App, slot: HTMLElement): Part | void {
  const preview = app.source.preview;
  if (!preview) return;
  let other: Ahead = "auto"; // the choice besides the present
  const choose = (): void => preview.choose(choice.value === HEARD ? other : "present");
  const choice = h("select", { class: "field", "aria-label": "The robot is shown", onchange: choose },
    ...[PRESENT, HEARD].map((text) => h("option", { text, value: text })));
  const told = h("div", { class: "note" });
  const panel = h("section", { class: "delays", "aria-label": "Delays", hidden: true }, h("label", {}, "The robot is shown ", choice), told);
  slot.append(panel);
  const change = new Change(PERIOD);
  return {
    show(shown: Shown): void {
      assign(panel, { hidden: preview.near && !preview.predicts });
      if (panel.hidden) return;
      if (preview.ahead !== "present") other = preview.ahead;
      const chosen = preview.ahead === "present" ? PRESENT : HEARD;
      if (choice.value !== chosen) choice.value = chosen;
      const lines = notes(preview, shown.t, app.connection!.now(), app.connection!.arrival);
      if (change.to(lines)) told.replaceChildren(...lines.map(([kind, line]) => h("div", { class: `delay ${kind}`, text: line })));
    },
  };
}

/** Returns the notes about time t, each with the class of its colour: "", predicted, flagged, unconfirmed or refused. */
export function notes(preview: Preview, t: number, now: number, arrival: number | null = null): [kind: string, line: string][] {
  const refused = preview.expected.filter((one) => one.refused);
  const found: [string, string][] = [
    ["", `D_f + D_b: ${Math.round(1e3 * preview.roundTrip)} ms`],
    ["", arrival === null ? "" : `D_f: ${Math.round(1e3 * (arrival - now))} ms at most; AT ${soonest(arrival)} is the earliest now`],
    ["", preview.predicts ? `heard: ${preview.heard(now).toFixed(2)} s` : ""],
    ["predicted", preview.predicts ? `predicted: ${preview.shown(now).toFixed(2)} s` : ""],
    ["flagged", preview.flag(t)],
    ["unconfirmed", preview.doubt(now)],
    ...refused.map((one): [string, string] => ["refused", `${one.text || "a command"} will be refused: ${one.refused}`]),
  ];
  return found.filter(([, line]) => line);
}

const QUESTIONS = /^\s*(WHERE|STATUS|IO|PARTS|SHOW)\b/i; // questions may have past times
const BEGIN = /\b(AT|IN)\s+(\d+\.?\d*|\.\d+)\s*$/i;

/** Returns how much time is left for a line that says when it begins to come to the robot in time; empty where it says
 * none. `dated`: IN counts from when the line is sent, not from when it comes. */
export function leadNote(line: string, now: number, arrival: number, dated: boolean): string {
  const [, word, time] = (!QUESTIONS.test(line) && BEGIN.exec(line)) || [];
  const after = word?.toUpperCase() === "IN";
  if (!word || (after && !dated)) return "";
  const spare = Number(time) + (after ? now : 0) - arrival;
  const earliest = after ? `IN ${soonest(arrival - now)}` : `AT ${soonest(arrival)}`;
  return spare < 0 ? `too late by ${(-spare).toFixed(1)} s: the earliest now is ${earliest}` : `in time: ${spare.toFixed(1)} s to spare beyond D_f`;
}

/** Returns t rounded up, with few digits. */
const soonest = (t: number): string => (Math.ceil(10 * t) / 10).toFixed(1);
