import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { App, Shown, Switch } from "../app";
import { Change } from "../core/change";
import { g, jointUnits, type Model } from "../core/kinematics";
import { fixed, speedsAt } from "../core/pose";
import { type Span, spanOf } from "../core/spans";
import type { Timeline } from "../core/timeline";
import { h } from "../dom";
import { colour, onTheme } from "../style/theme";

const SAMPLES = 300; // number of samples of a curve
const PERIOD = 400; // [ms] minimum time between two drawings
const READ_PERIOD = 100; // [ms] minimum time between two updates of the values
const COLOURS = 7;

/** A plot: its name, its curves, and their values at t. `range`: of the values, with a line at each limit. */
interface Kind {
  name: string;
  label: string;
  hint: string;
  unit: string;
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

/** Makes the plots over the span of the strip, with a line at the displayed time. A hidden plot is not computed. */
export function makeCurves(app: App, slot: HTMLElement, zoom: { seconds: number }): Switch[] {
  return KINDS.map((kind) => makePlot(app, slot, zoom, kind));
}

function makePlot(app: App, slot: HTMLElement, zoom: { seconds: number }, kind: Kind): Switch {
  const { model } = app.source;
  const curves = kind.curves(model);
  const inks = curves.map((_, i) => `--curve-${1 + (i % COLOURS)}`);
  const values = curves.map((name, i) => h("span", { class: "number", style: `color: var(${inks[i]})` }, `${name} `, h("b", {})));
  const line = h("div", { class: "plot-line" });
  const box = h("div", { class: "plot-box" }, line);
  const figure = h("figure", { class: "plot", hidden: true },
    h("figcaption", {}, h("span", { class: "heading", text: `${kind.label.replace("Curves: ", "")} [${kind.unit}]` }), h("span", { class: "values" }, ...values)), box);
  slot.append(figure);
  let chart: uPlot | null = null;
  let span: Span = { low: 0, high: 1 };
  const drawn = new Change(PERIOD, () => app.wake()), read = new Change(READ_PERIOD);
  const redraw = (): void => {
    drawn.forget();
    app.wake();
  };
  const size = (): { width: number; height: number } => ({ width: Math.max(box.clientWidth, 80), height: Math.max(box.clientHeight, 60) });

  function make(): uPlot {
    const axis = (size: number): uPlot.Axis => ({
      stroke: colour("--muted"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line"), width: 1, size: 4 },
      font: "11px system-ui, sans-serif", gap: 3, size,
    });
    const drawLimits = ({ ctx, bbox, valToPos }: uPlot): void => {
      ctx.save();
      ctx.strokeStyle = colour("--bad");
      ctx.setLineDash([4, 4]);
      for (const limit of [-100, 100]) {
        const y = Math.round(valToPos(limit, "y", true));
        ctx.stroke(new Path2D(`M${bbox.left} ${y}h${bbox.width}`));
      }
      ctx.restore();
    };
    const fitted = (_plot: uPlot, low: number | null, high: number | null): uPlot.Range.MinMax =>
      uPlot.rangeNum(low ?? 0, Math.max(high ?? 1, (low ?? 0) + 1), 0.1, true);
    return new uPlot({
      ...size(), legend: { show: false }, cursor: { show: false }, padding: [6, 14, 0, 0],
      scales: { x: { time: false, range: () => [span.low, span.high] }, y: { range: kind.range ?? fitted } },
      axes: [axis(20), axis(40)],
      series: [{}, ...curves.map((label, i) => ({ label, stroke: colour(inks[i]), width: 1.5 }))],
      hooks: { draw: kind.range ? [drawLimits] : [] },
    }, [], box);
  }
  new ResizeObserver(() => {
    if (figure.hidden) return;
    chart?.setSize(size());
    redraw();
  }).observe(box);
  onTheme(() => {
    chart?.destroy();
    chart = null;
    redraw();
  });

  app.add({
    show({ t, timeline }: Shown) {
      if (figure.hidden) return;
      span = spanOf(app.playback, zoom.seconds, t);
      if (drawn.to([timeline.number, timeline.version, timeline.segments.length, span])) {
        chart ??= make();
        chart.setData(sampled(model, timeline, span, kind) as uPlot.AlignedData);
      }
      if (!chart) return;
      const { left, width } = chart.over.getBoundingClientRect();
      line.style.transform = `translateX(${left - box.getBoundingClientRect().left + (width * (t - span.low)) / (span.high - span.low)}px)`;
      if (!read.to(`${t} ${timeline.number}`)) return;
      kind.values(model, timeline, t).forEach((value, i) => (values[i].lastElementChild!.textContent = fixed(value, 1)));
    },
  });
  const { name, label, hint } = kind;
  return {
    name, label, hint, on: false,
    set(on: boolean) {
      this.on = on;
      figure.hidden = !on;
      redraw();
    },
  };
}

function sampled(model: Model, timeline: Timeline, span: Span, kind: Kind): number[][] {
  const times = Array.from({ length: SAMPLES }, (_, i) => span.low + ((span.high - span.low) * i) / (SAMPLES - 1));
  const rows = times.map((t) => kind.values(model, timeline, t));
  return [times, ...rows[0].map((_, i) => rows.map((row) => row[i]))];
}
