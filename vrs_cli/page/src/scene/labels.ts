import * as THREE from "three";
import { h } from "../dom";
import type { Stage } from "./stage";

/** What a label is: more important ones have their place first. */
const RANKS = ["held", "why", "joint", "frame", "place", "branch", "command"] as const;
export type LabelKind = (typeof RANKS)[number];

interface Label {
  element: HTMLElement;
  kind: LabelKind;
  at: THREE.Vector3;
  width: number;
  height: number;
  shown: string;
}

/** Where a label may stand beside its point: the share of its width and height that it is moved. In the order of preference. */
const PLACES = [[0, -1], [0, 0], [-1, -1], [-1, 0], [-0.5, -1.5], [-0.5, 0.5]];
const GAP = 7; // [px] between a point and its label

/** Texts at points of the picture, as elements above the canvas. None covers another one; what finds no place is left out. */
export class Labels {
  private readonly layer = h("div", { class: "labels" });
  private readonly all = new Map<string, Label>();

  constructor(private readonly stage: Stage) {
    stage.view.append(this.layer);
    stage.beforeDraw.add(() => this.place());
  }

  /** Has a text at a point in the world [m]; `key` names it. */
  set(key: string, kind: LabelKind, text: string, [x, y, z]: ArrayLike<number> & Iterable<number>): void {
    let label = this.all.get(key);
    if (!label) {
      label = { element: h("div", { class: `label ${kind}` }), kind, at: new THREE.Vector3(), width: -1, height: 0, shown: "" };
      this.layer.append(label.element);
      this.all.set(key, label);
    }
    label.at.set(x, y, z);
    if (label.element.textContent === text) return;
    label.element.textContent = text;
    label.width = -1;
  }

  /** Takes away a label, or all whose key begins so. */
  remove(key: string): void {
    for (const [name, label] of this.all) {
      if (!name.startsWith(key)) continue;
      label.element.remove();
      this.all.delete(name);
    }
  }

  /** Puts all labels where they have room. */
  private place(): void {
    const { camera, width, height } = this.stage;
    const taken: [number, number, number, number][] = [];
    const point = new THREE.Vector3();
    const order = [...this.all.values()].sort((a, b) => RANKS.indexOf(a.kind) - RANKS.indexOf(b.kind));
    for (const label of order)
      if (label.width < 0) [label.width, label.height] = [label.element.offsetWidth, label.element.offsetHeight];
    for (const label of order) {
      point.copy(label.at).project(camera);
      const [x, y] = [((point.x + 1) / 2) * width, ((1 - point.y) / 2) * height];
      const free = point.z > 1 || point.z < -1 ? undefined : PLACES.map(([dx, dy]) => {
        const left = x + dx * label.width + (dx === 0 ? GAP : dx === -1 ? -GAP : 0);
        const top = y + dy * label.height + (dy > -0.5 ? GAP : -GAP) * (Math.abs(dx) === 0.5 ? 1 : 0.5);
        return [left, top, left + label.width, top + label.height] as [number, number, number, number];
      }).find(([l, t, r, b]) => l >= 0 && t >= 0 && r <= width && b <= height && !taken.some((o) => l < o[2] && r > o[0] && t < o[3] && b > o[1]));
      if (free) taken.push(free);
      const shown = free ? `translate(${Math.round(free[0])}px,${Math.round(free[1])}px)` : "";
      if (shown === label.shown) continue;
      label.shown = shown;
      label.element.style.transform = shown || "translate(-10000px,0)";
    }
  }
}
