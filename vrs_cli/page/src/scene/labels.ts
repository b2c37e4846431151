import * as THREE from "three";
import { h } from "../dom";
import type { Stage } from "./stage";

/** Kinds of labels, the most important first. */
const RANKS = ["held", "why", "joint", "frame", "part", "place", "branch", "command"] as const;
export type LabelKind = (typeof RANKS)[number];

interface Label {
  element: HTMLElement;
  kind: LabelKind;
  at: THREE.Vector3;
  width: number;
  height: number;
  shown: string;
}

/** Places of a label beside its point, as shares of its width and height, in order of preference. */
const PLACES = [[0, -1], [0, 0], [-1, -1], [-1, 0], [-0.5, -1.5], [-0.5, 0.5]];
const GAP = 7; // [px] between a point and its label

/** Returns the upper left corners of labels beside their points [px]; earlier labels have priority; null without room. */
export function arrange(labels: { x: number; y: number; width: number; height: number }[], width: number, height: number): ([number, number] | null)[] {
  const taken: [number, number, number, number][] = [];
  return labels.map((label) => {
    for (const [dx, dy] of PLACES) {
      const left = label.x + dx * label.width + (dx === 0 ? GAP : dx === -1 ? -GAP : 0);
      const top = label.y + dy * label.height + (dy > -0.5 ? 1 : -1) * (dx === -0.5 ? GAP : GAP / 2);
      const [right, bottom] = [left + label.width, top + label.height];
      if (left < 0 || top < 0 || right > width || bottom > height) continue;
      if (taken.some((other) => left < other[2] && right > other[0] && top < other[3] && bottom > other[1])) continue;
      taken.push([left, top, right, bottom]);
      return [left, top];
    }
    return null;
  });
}

/** Texts at points of the picture, as elements above the canvas. Labels never overlap; those without room are hidden. */
export class Labels {
  private readonly layer = h("div", { class: "labels" });
  private readonly all = new Map<string, Label>();

  constructor(private readonly stage: Stage) {
    stage.view.append(this.layer);
    stage.beforeDraw.add(() => this.place());
  }

  /** Sets a text at a point in the world [m]; `key` identifies it. */
  set(key: string, kind: LabelKind, text: string, [x, y, z]: ArrayLike<number> & Iterable<number>): void {
    let label = this.all.get(key);
    if (!label) {
      label = { element: h("div", { class: `label ${kind} out` }), kind, at: new THREE.Vector3(), width: -1, height: 0, shown: "" };
      this.layer.append(label.element);
      this.all.set(key, label);
    }
    label.at.set(x, y, z);
    if (label.element.textContent === text) return;
    label.element.textContent = text;
    label.width = -1;
  }

  /** Removes a label if `one`, else all labels whose key begins with `key`. */
  remove(key: string, one = false): void {
    for (const [name, label] of this.all) {
      if (one ? name !== key : !name.startsWith(key)) continue;
      label.element.remove();
      this.all.delete(name);
    }
  }

  /** Places all labels. */
  private place(): void {
    const { camera, width, height } = this.stage;
    const point = new THREE.Vector3();
    const order = [...this.all.values()].sort((a, b) => RANKS.indexOf(a.kind) - RANKS.indexOf(b.kind));
    for (const label of order)
      if (label.width < 0) [label.width, label.height] = [label.element.offsetWidth, label.element.offsetHeight];
    const seen = order.map((label) => {
      point.copy(label.at).project(camera);
      const before = Math.abs(point.z) <= 1; // before the camera, not behind it
      return { x: before ? ((point.x + 1) / 2) * width : -Infinity, y: ((1 - point.y) / 2) * height, width: label.width, height: label.height };
    });
    arrange(seen, width, height).forEach((at, i) => {
      const shown = at ? `${Math.round(at[0])}px,${Math.round(at[1])}px` : "";
      if (shown === order[i].shown) return;
      const { element } = order[i];
      element.classList.toggle("out", !at);
      element.style.transform = at ? `translate(${shown})` : "";
      order[i].shown = shown;
    });
  }
}
