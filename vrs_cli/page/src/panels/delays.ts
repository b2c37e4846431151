import type { App, Part, Shown } from "../app";
import { h } from "../dom";
import type { Ahead, Preview } from "../core/preview";

const PRESENT = "at its present";
const HEARD = "as it is heard, with a prediction";
/** [ms] between two texts at least: times that run on are read, not watched. */
const PERIOD = 100;

/** Makes the panel of delays: what is shown, and what is not certain. It is there once there is something to tell. */
export function makeDelays(app: App, slot: HTMLElement): Part | void {
  const preview = app.source.preview;
  if (!preview) return;
  let other: Ahead = "auto"; // what is chosen in place of the present
  const choice = h(
    "select",
    { class: "field", "aria-label": "The robot is shown", onchange: () => preview.choose(choice.value === HEARD ? other : "present") },
    ...[PRESENT, HEARD].map((text) => h("option", { text, value: text })),
  );
  const told = h("div", { class: "note" });
  const panel = h("section", { class: "delays", "aria-label": "Delays", hidden: true }, h("label", {}, "The robot is shown ", choice), told);
  slot.append(panel);
  let drawn = "";
  let due = 0;
  return {
    show(shown: Shown): void {
      panel.hidden = preview.near && !preview.predicts;
      if (panel.hidden || performance.now() < due) return;
      due = performance.now() + PERIOD;
      if (preview.ahead !== "present") other = preview.ahead;
      const chosen = preview.ahead === "present" ? PRESENT : HEARD;
      if (choice.value !== chosen) choice.value = chosen;
      const lines = notes(preview, shown.t, app.connection!.now());
      const text = lines.join("\n");
      if (text === drawn) return;
      drawn = text;
      told.replaceChildren(...lines.map(([kind, line]) => h("div", { class: `delay ${kind}`, text: line })));
    },
  };
}

/** Returns the notes about time t, each with the class of its colour: "", predicted, flagged, unconfirmed or refused. */
export function notes(preview: Preview, t: number, now: number): [kind: string, line: string][] {
  const found: [string, string][] = [["", `D_f + D_b: ${Math.round(1e3 * preview.roundTrip)} ms`]];
  if (preview.predicts) {
    found.push(["", `heard: ${preview.heard(now).toFixed(2)} s`]);
    found.push(["predicted", `predicted: ${preview.shown(now).toFixed(2)} s`]);
  }
  const flag = preview.flag(t);
  if (flag) found.push(["flagged", flag]);
  const doubt = preview.doubt(now);
  if (doubt) found.push(["unconfirmed", doubt]);
  for (const { text, refused } of preview.expected) if (refused) found.push(["refused", `${text || "a command"} will be refused: ${refused}`]);
  return found;
}
