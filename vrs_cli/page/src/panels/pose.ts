import type { App, Shown } from "../app";
import { fixed, inWorld, jointUnits, oat, speedsAt } from "../core/pose";
import { doingAt } from "../core/spans";
import type { Timeline } from "../core/timeline";
import { h } from "../dom";

const PERIOD = 66; // [ms] between two readings at least
const WORDS_PERIOD = 1000; // [ms] between two texts for screen readers
const NEAR = 0.02; // of the range of a joint, within which a limit is near
const DEGREES = 180 / Math.PI;

/** Makes the live pose: where the tool is and how it is turned, each joint within its range, speeds; and the same in words. */
export function makePose(app: App, slot: HTMLElement, view: HTMLElement): void {
  const { model, title } = app.source;
  const units = jointUnits(model);
  const cell = (): HTMLElement => h("td", { class: "number" });
  const places = ["X", "Y", "Z", "O", "A", "T"].map((name, i) => ({ name, unit: i < 3 ? "mm" : "°", cell: cell(), short: h("span", { class: "number" }) }));
  const joints = units.map((unit) => ({ ...unit, cell: cell(), speed: cell(), mark: h("i") }));
  const toolSpeed = h("td", { class: "number", colspan: "2" });
  const rowOf = (from: number): HTMLElement =>
    h("tr", {}, ...places.slice(from, from + 3).flatMap(({ name, cell }) => [h("th", { scope: "row", text: name }), cell]), h("td", { class: "unit", text: places[from].unit }));
  slot.append(h("div", { class: "pose" },
    h("table", { class: "tool-pose" }, h("caption", { class: "heading", text: "Tool" }), h("tbody", {}, rowOf(0), rowOf(3))),
    h("table", { class: "joint-pose" },
      h("caption", { class: "heading", text: "Joints" }),
      h("tbody", {},
        ...joints.map(({ name, unit, scale, lower, upper, cell, speed, mark }) =>
          h("tr", {}, h("th", { scope: "row", text: name }),
            h("td", { class: "range", title: `${fixed(lower * scale, 0)} to ${fixed(upper * scale, 0)} ${unit}` }, h("span", { class: "track" }, mark)),
            cell, h("td", { class: "unit", text: unit }), speed, h("td", { class: "unit", text: `${unit}/s` }))),
        h("tr", { class: "tool-speed" }, h("th", { scope: "row", colspan: "4", text: "Speed of the tool" }), toolSpeed)))));
  const compact = h("div", { class: "compact", "aria-hidden": "true" }, ...places.map(({ name, short }) => h("span", {}, h("b", { text: name }), " ", short)));
  const words = h("section", { class: "unseen", "aria-label": "The picture in words" });
  view.append(compact, words);

  const put = (element: HTMLElement, text: string): void => {
    if (element.textContent !== text) element.textContent = text;
  };
  let [drawn, told] = ["", ""];
  let drawnAt = -PERIOD;
  let toldAt = -WORDS_PERIOD;
  /** Tells the same in words. */
  function tell(t: number, timeline: Timeline, values: number[], q: number[], speed: number): void {
    const unitWord = (unit: string): string => (unit === "°" ? "degrees" : unit);
    const tooled = places.map(({ name, unit }, i) => `${name} ${fixed(values[i], 1)} ${unitWord(unit)}`).join(", ");
    const jointed = joints.map(({ name, unit, scale }, i) => `${name} ${fixed(scale * q[i], 1)} ${unitWord(unit)}`).join(", ");
    words.replaceChildren(...[
      `${title}: ${model.title || model.name}, ${joints.length} joints.`, `Time ${t.toFixed(1)} s: ${doingAt(timeline, t).text}.`,
      `Tool: ${tooled}, ${fixed(1000 * speed, 0)} mm/s.`, `Joints: ${jointed}.`,
    ].map((text) => h("p", { text })));
  }
  app.add({
    show({ t, q, tool, timeline }: Shown) {
      const key = `${timeline.number} ${doingAt(timeline, t).text} ${q.join()}`;
      const wall = performance.now();
      const [draws, tells] = [key !== drawn && wall >= drawnAt + PERIOD, key !== told && wall >= toldAt + WORDS_PERIOD];
      if (!draws && !tells) return;
      const T = inWorld(timeline, t, tool);
      const values = [...[3, 7, 11].map((i) => 1000 * T[i]), ...oat(T).map((angle) => DEGREES * angle)];
      const speeds = speedsAt(model, timeline, t);
      if (tells) {
        [told, toldAt] = [key, wall];
        tell(t, timeline, values, q, speeds.tool);
      }
      if (!draws) return;
      [drawn, drawnAt] = [key, wall];
      places.forEach(({ cell, short }, i) => {
        put(cell, fixed(values[i], 1));
        put(short, fixed(values[i], i < 3 ? 1 : 0));
      });
      joints.forEach(({ cell, speed, mark, scale, lower, upper }, i) => {
        put(cell, fixed(scale * q[i], 2));
        put(speed, fixed(scale * speeds.joints[i], 1));
        const share = (q[i] - lower) / (upper - lower);
        mark.style.left = `${100 * Math.min(Math.max(share, 0), 1)}%`;
        mark.className = share < NEAR || share > 1 - NEAR ? "near" : "";
      });
      put(toolSpeed, `${fixed(1000 * speeds.tool, 1)} mm/s`);
    },
  });
}
