import type { App, Shown } from "../app";
import { Change } from "../core/change";
import { DEGREES, jointUnits } from "../core/kinematics";
import { fixed, oat, speedsAt } from "../core/pose";
import { doingAt } from "../core/spans";
import { multiply, originOf } from "../core/transform";
import { h, put } from "../dom";

const PERIOD = 66; // [ms] minimum time between two updates
const WORDS_PERIOD = 1000; // [ms] between two texts for screen readers
const NEAR = 0.02; // of the range of a joint: distance at which a limit is marked

/** Makes the live pose: position and orientation of the tool, each joint within its range, speeds, and the same in words. */
export function makePose(app: App, slot: HTMLElement, view: HTMLElement): void {
  const { model, title } = app.source;
  const cell = (): HTMLElement => h("td", { class: "number" });
  const unitCell = (unit: string): HTMLElement => h("td", { class: "unit", text: unit });
  const head = (name: string): HTMLElement => h("th", { scope: "row", text: name });
  const table = (name: string, caption: string, rows: HTMLElement[]): HTMLElement =>
    h("table", { class: name }, h("caption", { class: "heading", text: caption }), h("tbody", {}, ...rows));
  const places = [..."XYZOAT"].map((name, i) => ({ name, unit: i < 3 ? "mm" : "°", cell: cell(), short: h("span", { class: "number" }) }));
  const joints = jointUnits(model).map((unit) => ({ ...unit, cell: cell(), speed: cell(), mark: h("i") }));
  const toolSpeed = h("td", { class: "number", colspan: "2" });
  const toolRows = [places.slice(0, 3), places.slice(3)].map((three) =>
    h("tr", {}, ...three.flatMap(({ name, cell }) => [head(name), cell]), unitCell(three[0].unit)));
  const jointRows = joints.map(({ name, unit, scale, lower, upper, cell, speed, mark }) => {
    const range = `${fixed(lower * scale, 0)} to ${fixed(upper * scale, 0)} ${unit}`;
    const track = h("td", { class: "range", title: range }, h("span", { class: "track" }, mark));
    return h("tr", {}, head(name), track, cell, unitCell(unit), speed, unitCell(`${unit}/s`));
  });
  const speedRow = h("tr", { class: "tool-speed" }, h("th", { scope: "row", colspan: "4", text: "Speed of the tool" }), toolSpeed);
  slot.append(h("div", { class: "pose" }, table("tool-pose", "Tool", toolRows), table("joint-pose", "Joints", [...jointRows, speedRow])));
  const compact = h("div", { class: "compact", "aria-hidden": "true" }, ...places.map(({ name, short }) => h("span", {}, h("b", { text: name }), " ", short)));
  const words = h("section", { class: "unseen", "aria-label": "The picture in words" });
  view.append(compact, words);

  /** Returns the values of joints or of the tool in words. */
  const inWords = (of: { name: string; unit: string }[], values: number[]): string =>
    of.map(({ name, unit }, i) => `${name} ${fixed(values[i], 1)} ${unit === "°" ? "degrees" : unit}`).join(", ");
  const drawn = new Change(PERIOD), told = new Change(WORDS_PERIOD);
  app.add({
    show({ t, q, tool, timeline }: Shown) {
      const doing = doingAt(timeline, t).text;
      const key = `${timeline.number} ${doing} ${q.join()}`;
      const [draws, tells] = [drawn.to(key), told.to(key)];
      if (!draws && !tells) return;
      const T_world_tool = multiply(timeline.base(t), tool);
      const placed = [...originOf(T_world_tool).map((x) => 1000 * x), ...oat(T_world_tool).map((angle) => DEGREES * angle)];
      const turned = joints.map(({ scale }, i) => scale * q[i]);
      const speeds = speedsAt(model, timeline, t);
      if (tells)
        words.replaceChildren(...[
          `${title}: ${model.title || model.name}, ${joints.length} joints.`, `Time ${t.toFixed(1)} s: ${doing}.`,
          `Tool: ${inWords(places, placed)}, ${fixed(1000 * speeds.tool, 0)} mm/s.`, `Joints: ${inWords(joints, turned)}.`,
        ].map((text) => h("p", { text })));
      if (!draws) return;
      places.forEach(({ cell, short }, i) => {
        put(cell, fixed(placed[i], 1));
        put(short, fixed(placed[i], i < 3 ? 1 : 0));
      });
      joints.forEach(({ cell, speed, mark, scale, lower, upper }, i) => {
        put(cell, fixed(turned[i], 2));
        put(speed, fixed(scale * speeds.joints[i], 1));
        const share = (q[i] - lower) / (upper - lower);
        mark.style.left = `${100 * Math.min(Math.max(share, 0), 1)}%`;
        mark.className = share < NEAR || share > 1 - NEAR ? "near" : "";
      });
      put(toolSpeed, `${fixed(1000 * speeds.tool, 1)} mm/s`);
    },
  });
}
