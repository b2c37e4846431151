import { button, h } from "./dom";
import { icon } from "./style/icons";
import { remember, remembered } from "./core/storage";
import "./style/layout.css";

const TABS = ["Programs", "Move", "Drag", "Signals"] as const;
/** The places of the page for panels. */
export type Slot =
  | "stop" | "drives" | "prompt" | "output" | "questions" | "hint" | `tab:${(typeof TABS)[number]}` | "head"
  | "show" | "pose" | "curves" | "bar" | "strip" | "delays" | "notice" | "canvas" | "camera";

/** A small page, or one used by touch: its panels are a sheet with tabs. */
export const PHONE = matchMedia("(max-width: 699px), (max-height: 499px)");

/** Lays out the page and returns its places. Header, picture, column of commands, live pose and curves, time. */
export function makeLayout(): (name: Slot) => HTMLElement {
  const slots = new Map<Slot, HTMLElement>();
  const place = (name: Slot, props: Record<string, string> = {}): HTMLElement => {
    const element = h("div", { "data-slot": name, ...props });
    slots.set(name, element);
    return element;
  };
  const talk = h("section", { class: "talk", "aria-label": "Commands" },
    place("drives"), place("output", { role: "log", "aria-live": "polite", "aria-label": "What was said", tabindex: "0" }),
    place("hint"), place("questions", { "aria-live": "assertive" }), place("prompt"));
  const live = h("section", { class: "live", tabindex: "0", "aria-label": "Live pose" }, place("pose"));
  const curves = h("section", { class: "curves", tabindex: "0", "aria-label": "Curves" }, place("curves"));
  const panels = TABS.map((name) => panel(name, place(`tab:${name}`)));
  const [commands, pose] = [panel("Commands"), panel("Pose")];
  const [tabs, refresh] = makeTabs([commands, ...panels, pose]);
  const aside = h("aside", { class: "side", "aria-label": "Commands and programs", id: "side" },
    makeSplitter("sheet-height", "--sheet", "Height of the panels", -1), talk, makeSplitter("talk-height", "--talk", "Height of the commands", 1), tabs, commands, ...panels, pose);
  const view = h("main", { class: "view", "aria-label": "The robot" },
    place("canvas"), place("notice"), place("delays"));
  const head = h("header", { class: "head" },
    sideButton(aside), place("head"), h("div", { class: "tools", role: "toolbar", "aria-label": "View" }, place("camera"), place("show")), place("stop"));
  const foot = h("section", { class: "foot", "aria-label": "Time" }, place("bar"), place("strip"));
  aside.append(makeSplitter("side-width", "--side", "Width of the commands", 1));
  document.body.append(head, aside, view, foot);
  const arrange = (): void => {
    (PHONE.matches ? commands : aside).prepend(talk);
    if (PHONE.matches) pose.append(live, curves);
    else view.after(live, curves);
    document.body.classList.toggle("phone", PHONE.matches);
    refresh();
  };
  PHONE.addEventListener("change", arrange);
  arrange();
  const filled = new MutationObserver(refresh);
  for (const element of slots.values()) if (element.closest(".side, .live, .curves")) filled.observe(element, { childList: true });
  return (name) => slots.get(name)!;
}

function panel(name: string, slot?: HTMLElement): HTMLElement {
  const element = h("section", { class: "tab-panel", role: "tabpanel", tabindex: "0", id: `tab-${name}`, "aria-labelledby": `to-${name}` });
  if (slot) element.append(slot);
  return element;
}

/** Makes the tabs of panels; an empty panel has none. Returns their list, and a function that updates it. */
function makeTabs(panels: HTMLElement[]): [HTMLElement, () => void] {
  const name = (of: HTMLElement): string => of.id.slice(4);
  const filled = (of: HTMLElement): boolean => !!of.querySelector("[data-slot]:not(:empty)");
  const list = h("div", { class: "tabs", role: "tablist", "aria-label": "Panels" });
  let chosen = remembered("tab") ?? "";
  const tabs = panels.map((panel) =>
    h("button", {
      class: "tab", role: "tab", id: `to-${name(panel)}`, "aria-controls": panel.id, text: name(panel), type: "button",
      onclick: () => choose(name(panel)),
    }));
  function refresh(): void {
    const there = panels.filter(filled).map(name);
    const now = there.includes(chosen) ? chosen : there[0];
    panels.forEach((panel, i) => {
      const is = name(panel) === now;
      panel.hidden = !is;
      tabs[i].hidden = !there.includes(name(panel));
      tabs[i].setAttribute("aria-selected", String(is));
      tabs[i].tabIndex = is ? 0 : -1;
    });
    list.hidden = there.length === 0;
    document.body.classList.toggle("without-tabs", there.length === 0);
  }
  function choose(to: string): void {
    remember("tab", (chosen = to));
    refresh();
  }
  list.addEventListener("keydown", (event) => {
    const shown = tabs.filter((tab) => !tab.hidden);
    const at = shown.indexOf(document.activeElement as HTMLButtonElement);
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1, Home: 0, End: shown.length - 1 }[event.key];
    if (at < 0 || to === undefined) return;
    event.preventDefault();
    const tab = shown[(to + shown.length) % shown.length];
    tab.click();
    tab.focus();
  });
  list.append(...tabs);
  return [list, refresh];
}

/** Makes a bar to change a size of the layout [px], by dragging or arrow keys; the size is stored. */
function makeSplitter(name: string, property: string, label: string, sign: 1 | -1): HTMLElement {
  const upright = property === "--side";
  const element = h("div", {
    class: `splitter ${name}`, role: "separator", tabindex: "0", "aria-label": label,
    "aria-orientation": upright ? "vertical" : "horizontal", "aria-valuemin": "10", "aria-valuemax": "80", "aria-valuenow": "30",
  });
  const whole = (): number => (upright ? innerWidth : innerHeight);
  const along = (event: PointerEvent): number => sign * (upright ? event.clientX : event.clientY);
  const size = (): number => {
    const of = document.querySelector(property === "--talk" ? ".talk" : ".side")!.getBoundingClientRect();
    return upright ? of.width : of.height;
  };
  function resize(to: number | null): void {
    const share = to && Math.min(Math.max(to / whole(), 0.1), 0.8);
    document.documentElement.style.setProperty(property, share ? `${(100 * share).toFixed(2)}${upright ? "vw" : "dvh"}` : null);
    if (share) element.ariaValueNow = String(Math.round(100 * share));
    remember(name, share ? String(share) : null);
  }
  element.addEventListener("pointerdown", (event) => {
    const from = size() - along(event);
    element.setPointerCapture(event.pointerId);
    const move = (now: PointerEvent): void => resize(from + along(now));
    element.addEventListener("pointermove", move);
    element.addEventListener("lostpointercapture", () => element.removeEventListener("pointermove", move), { once: true });
    event.preventDefault();
  });
  element.addEventListener("dblclick", () => resize(null));
  element.addEventListener("keydown", (event) => {
    const by = { ArrowRight: 16, ArrowDown: 16, ArrowLeft: -16, ArrowUp: -16 }[event.key];
    if (by === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    resize(size() + sign * by);
  });
  const kept = Number(remembered(name));
  if (kept > 0) resize(kept * whole());
  return element;
}

/** Makes the button that hides the column of commands, and shows it again. */
function sideButton(aside: HTMLElement): HTMLElement {
  const name = "Commands and programs";
  const set = (open: boolean): void => {
    document.body.classList.toggle("side-closed", !open);
    made.ariaExpanded = String(open);
    remember("side", open ? null : "closed");
  };
  const toggle = (): void => set(document.body.classList.contains("side-closed"));
  const made = button(icon("side"), toggle, { class: "icon quiet side-button", title: name, "aria-label": name, "aria-controls": aside.id });
  set(remembered("side") !== "closed");
  return made;
}
