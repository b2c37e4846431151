import type { App } from "../app";
import { h } from "../dom";
import { PHONE } from "../layout";
import type { CameraAction } from "../scene/scene";
import { type Icon, icon } from "../style/icons";
import { fold, menu } from "../style/menu";
import { type Theme, chooseTheme, chosenTheme, remember, remembered } from "../style/theme";
import type { Action } from "./bar";

/** Something that can be shown or not. */
export interface Switch {
  readonly name: string;
  readonly label: string;
  readonly hint: string;
  readonly on: boolean;
  set(on: boolean): void;
}

const CAMERA_ICONS: Record<CameraAction["name"], Icon> = { home: "home", fit: "fit", front: "front", side: "right", top: "top", follow: "tool" };
const THEMES: [Theme, string][] = [["system", "As the system"], ["light", "Light"], ["dark", "Dark"]];

/** Makes the menu of what is shown, which this browser remembers, and of light and dark. Returns what can be done, for keys. */
export function makeShow(slot: HTMLElement, groups: { heading: string; switches: Switch[] }[]): Action[] {
  const actions: Action[] = [];
  const content = h("div", { class: "show-menu", role: "group", "aria-label": "Show" });
  for (const { heading, switches } of groups) {
    content.append(h("h2", { class: "heading", text: heading }), ...switches.map((one) => {
      const kept = remembered(`show ${one.name}`);
      if (kept !== null && (kept === "on") !== one.on) one.set(kept === "on");
      const box = h("input", { type: "checkbox" });
      box.checked = one.on;
      const set = (on: boolean): void => {
        one.set(on);
        box.checked = on;
        remember(`show ${one.name}`, on ? "on" : "off");
      };
      box.addEventListener("change", () => set(box.checked));
      actions.push({ label: `Show or hide: ${one.label}`, key: "", run: () => set(!one.on) });
      return h("label", { class: "switch", title: one.hint }, box, one.label);
    }));
  }
  const themes = THEMES.map(([theme, label]) => {
    const button = h("button", { type: "button", class: "button", text: label, onclick: () => choose(theme) });
    actions.push({ label: `Theme: ${label.toLowerCase()}`, key: "", run: () => choose(theme) });
    return button;
  });
  function choose(theme: Theme): void {
    chooseTheme(theme);
    mark();
  }
  const mark = (): void => themes.forEach((button, i) => button.setAttribute("aria-pressed", String(THEMES[i][0] === chosenTheme())));
  mark();
  content.append(h("h2", { class: "heading", text: "Theme" }), h("div", { class: "group", role: "group", "aria-label": "Theme" }, ...themes));
  slot.append(...menu(content, "eye", "Show", "Show"));
  return actions;
}

/** Makes the buttons of the camera. Returns what they do, for keys. */
export function makeCamera(app: App, slot: HTMLElement, cameras: CameraAction[]): Action[] {
  const buttons = cameras.map((camera) =>
    h("button", {
      type: "button", class: "button icon", "aria-label": camera.label, title: `${camera.label}: ${camera.hint}`,
      ...(camera.name === "follow" ? { "aria-pressed": "false" } : {}), onclick: () => run(camera),
    }, icon(CAMERA_ICONS[camera.name]), h("span", { class: "name", text: camera.label })));
  function run(camera: CameraAction): void {
    camera.run();
    cameras.forEach((one, i) => one.name === "follow" && buttons[i].setAttribute("aria-pressed", String(!!one.on)));
    app.wake();
  }
  slot.append(...fold(h("div", { class: "group cameras", role: "group", "aria-label": "Camera" }, ...buttons), "camera", "Camera", PHONE));
  return cameras.map((camera) => ({ label: `Camera: ${camera.label}`, key: "", run: () => run(camera) }));
}
