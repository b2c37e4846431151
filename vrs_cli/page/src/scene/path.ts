import * as THREE from "three";
import { Change } from "../core/change";
import type { Model } from "../core/kinematics";
import type { Point } from "../core/transform";
import type { InWorld } from "./scene";
import { Dots, Lines, type Piece } from "./lines";
import type { Stage } from "./stage";
import { Way, type WayLine } from "./way";

const AROUND = 60; // [s] of the way to either side of the present
const STEP = 20; // [s] after which that is looked at anew
const WIDTH = 3; // [px] of lines
const WIDE = 8; // [px] of what is not confirmed and of what was shown wrongly, behind the lines
const [DOT, MARK] = [5, 9]; // [px] between two segments, and where a command takes over
const MAX_TEXTS = 40; // of commands
const COST = 10; // times as long as it took to draw the way, it is not drawn again
const RECENT = 60; // [s] that what was shown wrongly stays in the picture

/** Returns the texts at each place; places nearer to each other than that [m] are one. */
export function gather(named: { at: Point; text: string }[], near: number): { at: Point; texts: string[] }[] {
  const found: { at: Point; texts: string[] }[] = [];
  for (const { at, text } of named) {
    const here = found.find((one) => one.at.every((x, i) => Math.abs(x - at[i]) < near));
    if (here) here.texts.push(text);
    else found.push({ at, texts: [text] });
  }
  return found;
}

/** The way of the tool, past and planned, and where each command takes over. */
export class PathView {
  readonly root = new THREE.Group();
  commands = false;
  private readonly way: Way;
  private readonly past = new Lines(WIDTH);
  private readonly planned = new Lines(WIDTH);
  private readonly wide = new Lines(WIDE);
  private readonly dots = new Dots(DOT);
  private readonly marks = new Dots(MARK);
  private drawn: unknown[] = [];
  private readonly sides = new Change();
  private drawings = 0;
  private near: WayLine[] = [];
  private wait = 0; // [ms] until when the way is not drawn again
  private timer = 0;

  constructor(private readonly stage: Stage, model: Model) {
    this.way = new Way(model);
    this.wide.mesh.renderOrder = -1;
    this.wide.mesh.material.depthWrite = false;
    this.root.add(this.wide.mesh, this.past.mesh, this.planned.mesh, this.dots.points, this.marks.points);
    stage.onPaint.add(() => this.redraw());
  }

  set visible(on: boolean) {
    this.root.visible = on;
    this.redraw();
  }

  /** Has the way drawn anew at the next moment. */
  redraw(): void {
    this.drawn = [];
  }

  show(shown: InWorld): void {
    if (!this.root.visible) {
      if (this.drawn.length) this.stage.labels.remove("command ");
      this.drawn = [];
      return;
    }
    const { t, timeline } = shown;
    const wanted = [timeline, timeline.version, timeline.number, timeline.segments.length, Math.floor(t / STEP), this.commands];
    if (wanted.some((x, i) => x !== this.drawn[i])) {
      const begin = performance.now();
      if (begin < this.wait && this.drawn.length) {
        window.clearTimeout(this.timer);
        this.timer = window.setTimeout(() => this.stage.change(), this.wait - begin + 1);
      } else {
        this.draw(shown);
        this.drawn = wanted;
        this.drawings++;
        this.wait = performance.now() + COST * (performance.now() - begin);
      }
    }
    this.past.showUntil(t);
    this.planned.showFrom(t);
    this.showSides(shown);
  }

  private draw({ t, timeline }: InWorld): void {
    const at = Math.floor(t / STEP) * STEP;
    const { colours, reach } = this.stage;
    this.near = this.way.lines(timeline, at - AROUND, at + STEP + AROUND, t);
    this.past.set(this.near.flatMap((line) => piecesOf(line, line.blends ? colours.pastBlend : colours.past)));
    this.planned.set(this.near.flatMap((line) => piecesOf(line, line.blends ? colours.plannedBlend : colours.planned)));
    const starts = this.near.filter((line) => line.starts);
    this.dots.set(this.near.filter((line) => !line.steers).map((line) => line.points[line.points.length - 1]), colours.dot);
    this.marks.set(starts.map((line) => line.points[0]), colours.mark);
    this.stage.labels.remove("command ");
    if (!this.commands) return;
    const shown = starts.sort((a, b) => Math.abs(a.begin - t) - Math.abs(b.begin - t)).slice(0, MAX_TEXTS).sort((a, b) => a.begin - b.begin);
    const written = shown.map((line) => ({ at: line.points[0], text: line.segment.motion.text ?? "" })).filter(({ text }) => text);
    gather(written, 0.02 * reach).forEach(({ at, texts }, k) => this.stage.labels.set(`command ${k}`, "command", texts.join("\n"), at));
  }

  /** Draws what is not confirmed, and what was shown wrongly a while ago, of a robot behind a line with delays. */
  private showSides({ t, now, source }: InWorld): void {
    const { preview } = source;
    const since = preview ? preview.unconfirmed(now) : Infinity;
    const flagged = (preview?.flagged ?? []).filter(([begin, end]) => t - RECENT < end && begin < t + RECENT);
    if (!this.sides.to([this.drawings, Math.round(20 * since), flagged])) return;
    const { unconfirmed, flagged: wrong } = this.stage.colours;
    this.wide.set([...this.cut(since, Infinity, unconfirmed), ...flagged.flatMap(([begin, end]) => this.cut(begin, end, wrong))]);
  }

  /** Returns the pieces of the way between two times. */
  private cut(begin: number, end: number, colour: string): Piece[] {
    return this.near.flatMap((line) => piecesOf(line, colour)).flatMap((piece) => {
      const { a, b, from, to } = piece;
      const [first, last] = [Math.max(begin, from), Math.min(end, to)];
      const at = (t: number): Point => a.map((x, k) => x + ((t - from) / (to - from)) * (b[k] - x)) as Point;
      return first < last ? [{ ...piece, a: at(first), b: at(last), from: first, to: last }] : [];
    });
  }
}

/** Returns the pieces of a line in a colour. */
function piecesOf({ begin, times, points }: WayLine, paint: string): Piece[] {
  const colour = new THREE.Color(paint);
  return points.slice(1).map((b, i) => ({ a: points[i], b, from: begin + times[i], to: begin + times[i + 1], colour }));
}
