import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { App, Shown } from "../app";
import { g, type Model } from "../core/kinematics";
import { fixed, jointUnits, speedsAt } from "../core/pose";
import { type Span, spanOf } from "../core/spans";
import type { Timeline } from "../core/timeline";
import { h } from "../dom";
import { colour, onTheme } from "../style/theme";

const SAMPLES = 300; // of a curve
const PERIOD = 400; // [ms] between two drawings at least
const READ_PERIOD = 100; // [ms] between two readings of the values
const COLOURS = 7;

/** A plot: its name, its curves, and their values at t; `band`: the limits that are drawn. */
export interface Plot {
  name: string;
  label: string;
  hint: string;
  unit: string;
  on: boolean;
  set(on: boolean): void;
}
interface Kind extends Omit<Plot, "on" | "set"> {
  curves(model: Model): string[];
  values(model: Model, timeline: Timeline, t: number): number[];
  range?: [number, number];
}

const names = (model: Model): string[] => jointUnits(model).map(({ name }) => name);
const KINDS: Kind[] = [
  {
    name: "joints", label: "Curves: joints", hint: "The joints over the time that the strip shows", unit: "°, mm", curves: names,
    values: (model, timeline, t) => {
      const q = g(model, timeline, t);
      return jointUnits(model).map(({ scale }, i) => scale * q[i]);
    },
  },
  {
    name: "speeds", label: "Curves: joint speeds", hint: "The speed of each joint as a share of its limit", unit: "% of limit", curves: names, range: [-105, 105],
    values: (model, timeline, t) => {
      const { joints } = speedsAt(model, timeline, t);
      return jointUnits(model).map(({ limit }, i) => (100 * joints[i]) / limit);
    },
  },
  {
    name: "tool", label: "Curves: tool speed", hint: "The speed of the tool", unit: "mm/s", curves: () => ["tool"],
    values: (model, timeline, t) => [1000 * speedsAt(model, timeline, t).tool],
  },
];

/** Makes the plots over what the strip spans, with a line at the time that is shown. A plot that is off costs nothing. */
export function makeCurves(app: App, slot: HTMLElement, zoom: { seconds: number }): Plot[] {
  return KINDS.map((kind) => makePlot(app, slot, zoom, kind));
}

function makePlot(app: App, slot: HTMLElement, zoom: { seconds: number }, kind: Kind): Plot {
  const { model } = app.source;
  const curves = kind.curves(model);
  const values = curves.map((name, i) => h("span", { class: "number", style: `color: var(--curve-${1 + (i % COLOURS)})` }, `${name} `, h("b", {})));
  const line = h("div", { class: "plot-line" });
  const box = h("div", { class: "plot-box" }, line);
  const figure = h("figure", { class: "plot", hidden: true },
    h("figcaption", {}, h("span", { class: "heading", text: `${kind.label.replace("Curves: ", "")} [${kind.unit}]` }), h("span", { class: "values" }, ...values)), box);
  let chart: uPlot | null = null;
  let span: Span = { low: 0, high: 1 };
  let drawn = "";
  let drawnAt = -PERIOD;
  let readAt = -READ_PERIOD;
  let read = "";
  const size = (): { width: number; height: number } => ({ width: Math.max(box.clientWidth, 80), height: Math.max(box.clientHeight, 60) });

  function make(): uPlot {
    const axis = (extra: uPlot.Axis): uPlot.Axis => ({
      stroke: colour("--muted"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1, size: 4 }, font: "11px system-ui, sans-serif", gap: 3, ...extra,
    });
    const limits = (plot: uPlot): void => {
      if (!kind.range) return;
      plot.ctx.save();
      plot.ctx.strokeStyle = colour("--bad");
      plot.ctx.setLineDash([4, 4]);
      for (const limit of [-100, 100]) {
        const y = Math.round(plot.valToPos(limit, "y", true));
        plot.ctx.beginPath();
        plot.ctx.moveTo(plot.bbox.left, y);
        plot.ctx.lineTo(plot.bbox.left + plot.bbox.width, y);
        plot.ctx.stroke();
      }
      plot.ctx.restore();
    };
    return new uPlot({
      ...size(), legend: { show: false }, cursor: { show: false }, padding: [6, 6, 0, 0],
      scales: { x: { time: false, range: () => [span.low, span.high] }, y: kind.range ? { range: kind.range } : { range: (_plot, low, high) => uPlot.rangeNum(low ?? 0, Math.max(high ?? 1, (low ?? 0) + 1), 0.1, true) } },
      axes: [axis({ size: 20 }), axis({ size: 40 })],
      series: [{}, ...curves.map((label, i) => ({ label, stroke: colour(`--curve-${1 + (i % COLOURS)}`), width: 1.5 }))],
      hooks: { draw: [limits] },
    }, [], box);
  }
  new ResizeObserver(() => {
    if (figure.hidden) return;
    chart?.setSize(size());
    drawn = "";
    app.wake();
  }).observe(box);
  onTheme(() => {
    chart?.destroy();
    chart = null;
    drawn = "";
    app.wake();
  });

  app.add({
    show({ t, timeline }: Shown) {
      if (figure.hidden) return;
      span = spanOf(app.playback, zoom.seconds, t);
      const wall = performance.now();
      const key = [timeline.number, timeline.version, timeline.segments.length, span.low, span.high].join();
      if (key !== drawn && wall >= drawnAt + PERIOD) {
        [drawn, drawnAt] = [key, wall];
        chart ??= make();
        chart.setData(sampled(model, timeline, span, kind) as uPlot.AlignedData);
      } else if (key !== drawn) app.wake();
      if (!chart) return;
      const { left, width } = chart.over.getBoundingClientRect();
      line.style.transform = `translateX(${left - box.getBoundingClientRect().left + (width * (t - span.low)) / (span.high - span.low)}px)`;
      const moment = `${t} ${timeline.number}`;
      if (moment === read || wall < readAt + READ_PERIOD) return;
      [read, readAt] = [moment, wall];
      kind.values(model, timeline, t).forEach((value, i) => (values[i].lastElementChild!.textContent = fixed(value, 1)));
    },
  });
  slot.append(figure);
  return {
    ...kind,
    get on() {
      return !figure.hidden;
    },
    set(to: boolean) {
      figure.hidden = !to;
      drawn = "";
      app.wake();
    },
  };
}

function sampled(model: Model, timeline: Timeline, span: Span, kind: Kind): number[][] {
  const times = Array.from({ length: SAMPLES }, (_, i) => span.low + ((span.high - span.low) * i) / (SAMPLES - 1));
  const rows = times.map((t) => kind.values(model, timeline, t));
  return [times, ...rows[0].map((_, i) => rows.map((row) => row[i]))];
}
