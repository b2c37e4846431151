import type { Part, Shown } from "../app";
import { Change } from "../core/change";
import type { Message } from "../core/connection";
import { DEGREES, jointUnits } from "../core/kinematics";
import { type Residual, residualOf } from "../core/measured";
import { fixed } from "../core/pose";
import { assign, button, h, put } from "../dom";
import type { Commands } from "./commands";

const PERIOD = 200; // [ms] minimum time between two updates
const OLD = 0.2; // [s] a greater age of the last report is displayed

/** Makes the panel of the robot's body: its measured position, its state, alarms, and RESYNC if the server has it. It
 * appears with the first body. */
export function makeBody(commands: Commands, slot: HTMLElement): Part {
  const { app, connection } = commands;
  const { model, measured, preview } = app.source;
  if (!measured) return { show: () => {} };
  const [where, who] = [h("span"), h("summary")];
  const counts = h("div", { class: "note" });
  const predicted = h("li", {}, h("span", { class: "swatch predicted" }), "predicted");
  const [said, past] = [h("div", { role: "alert" }), h("ul", { class: "list" })];
  const look = button("Look", () => app.playback.seek(measured.alarms.at(-1)!.since), { title: "Show the time at which the difference began" });
  const close = button("Close", () => ((measured.alarms = []), app.wake()), { class: "quiet", title: "Take the alarms away" });
  const alarm = h("div", { class: "note bad", hidden: true }, said);
  const resync = button("RESYNC", () => commands.command("RESYNC"), {
    hidden: true, title: "The body holds, the timeline goes to where it is measured and on to its goal, and the body follows again",
  });
  const panel = h("section", { class: "delays body", "aria-label": "Body", hidden: true }, alarm, h("div", { class: "row" }, resync, look, close),
    h("ul", { class: "legend", "aria-label": "Appearances of the arm" }, h("li", {}, h("span", { class: "swatch virtual" }), "virtual"), predicted,
      h("li", {}, h("span", { class: "swatch measured" }), h("b", { text: "measured" }), where)),
    h("details", {}, who, counts, past));
  slot.append(panel);
  const change = new Change(PERIOD, () => app.wake());
  let life: string | undefined;
  /** Asks a server once whether it has the word. */
  const know = async (): Promise<void> => {
    life = connection.welcome!.life;
    const { choices = [] } = await connection.ask("complete", { text: "RESYN", everything: true });
    resync.hidden = !commands.supervises || !(choices as Message[]).some(({ text }) => text === "RESYNC");
  };
  return {
    show(shown: Shown): void {
      const { body, unknown, alarms } = measured;
      assign(panel, { hidden: !body && !measured.last });
      if (panel.hidden) return;
      if (commands.open && life !== connection.welcome!.life) void know();
      assign(resync, { disabled: !commands.mayDrive });
      assign(predicted, { hidden: !preview?.predicts });
      const report = shown.measured;
      if (!change.to([report?.t, shown.timeline.number, body, unknown, alarms.length, alarms.at(-1)])) return;
      const age = app.playback.following && report ? connection.now() - report.t : 0;
      const since = app.playback.following && (unknown ?? (commands.open ? null : report?.t));
      const lost = typeof since === "number" ? `unknown since ${since.toFixed(2)} s, then ` : "";
      put(where, report ? lost + differenceOf(model, residualOf(model, shown.timeline, report), lost ? 0 : age) : "unknown at this time");
      put(who, body ? bodyOf(body) : "no body");
      put(counts, body ? countsOf(body) : "");
      const last = alarms.at(-1);
      alarm.hidden = look.hidden = close.hidden = !last;
      put(said, last ? alarmOf(last) : "");
      past.replaceChildren(...alarms.slice(0, -1).reverse().map((one) => h("li", { text: alarmOf(one) })));
    },
  };

  function differenceOf(of: typeof model, { joints, distance, angle }: Residual, age: number): string {
    const worst = joints.reduce((most, x, i) => (Math.abs(x) > Math.abs(joints[most]) ? i : most), 0);
    const { name, unit, scale } = jointUnits(of)[worst];
    const off = `${fixed(1000 * distance, 1)} mm, ${fixed(DEGREES * angle, 2)}° off (${name} ${fixed(scale * joints[worst], 2)} ${unit})`;
    return age > OLD ? `${off}, ${age.toFixed(2)} s ago` : off;
  }
}

/** Describes the body and its state. */
export function bodyOf({ name, mode = "follows", order = "follows" }: Message): string {
  if (!name) return "nobody is the body now";
  const ordered = order === mode ? "" : order === "holds" ? ", is to hold" : ", is to follow";
  return `${name} ${mode}${ordered}`;
}

/** Describes the reports of a body, and its clock. */
export function countsOf({ counts = {}, rate = 0, delay = 0, offset = 0 }: Message): string {
  const bad = ["lost", "late", "duplicate", "reordered"].filter((name) => counts[name]).map((name) => `${counts[name]} ${name}`);
  return [`${counts.received ?? 0} reports, ${rate.toFixed(0)} a second`, ...bad, `${Math.round(1000 * delay)} ms old on arrival`,
    `its clock is ${Math.abs(Math.round(1000 * offset))} ms ${offset < 0 ? "behind" : "ahead"}`].join(", ");
}

export const alarmOf = ({ t, joint, cause, detail }: Message): string => `${t.toFixed(2)} s, JT${joint}: likely cause: ${cause}; ${detail}`;
