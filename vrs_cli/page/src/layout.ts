import { h } from "./dom";

/** The places of the page in which panels are made. */
export type Slot =
  | "stop" | "drives" | "prompt" | "output" | "questions" | "tab:Programs" | "tab:Move" | "tab:Drag" | "tab:Signals"
  | "show" | "pose" | "curves" | "bar" | "strip" | "delays" | "notice" | "canvas" | "camera";

const SIDE: Slot[] = ["drives", "questions", "prompt", "output", "tab:Programs", "tab:Move", "tab:Drag", "tab:Signals", "pose", "curves", "show"];
const OVER: Slot[] = ["notice", "stop", "camera", "delays"];

/** Lays out the page and returns its places. */
export function makeLayout(): (name: Slot) => HTMLElement {
  const slots = new Map<Slot, HTMLElement>();
  const place = (name: Slot): HTMLElement => {
    const element = h("div", { "data-slot": name });
    slots.set(name, element);
    return element;
  };
  document.body.append(
    h("main", {}, place("canvas"), ...OVER.map(place)),
    h("aside", {}, ...SIDE.map(place)),
    h("footer", {}, place("bar"), place("strip")),
  );
  return (name) => slots.get(name)!;
}
