import type { App, Switch } from "../app";
import { remember, remembered } from "../core/storage";
import { button, choice, group, h } from "../dom";
import { PHONE } from "../layout";
import type { CameraAction } from "../scene/scene";
import { fold, icon, menu } from "../style/icons";
import { type Theme, chooseTheme, chosenTheme } from "../style/theme";
import type { Action } from "./bar";

const THEMES: Record<Theme, string> = { system: "As the system", light: "Light", dark: "Dark" };

/** Makes the menu of displayed things and of light and dark; this browser stores the choices. Returns its actions, for keys. */
export function makeShow(slot: HTMLElement, groups: { heading: string; switches: Switch[] }[]): Action[] {
  const actions: Action[] = [];
  const content = h("div", { class: "show-menu", role: "group", "aria-label": "Show" });
  for (const { heading, switches } of groups) {
    content.append(h("h2", { class: "heading", text: heading }), ...switches.map((one) => {
      const kept = remembered(`show ${one.name}`);
      if (kept !== null && (kept === "on") !== one.on) one.set(kept === "on");
      const box = h("input", { type: "checkbox", onchange: () => set(box.checked) });
      box.checked = one.on;
      const set = (on: boolean): void => {
        one.set(on);
        box.checked = on;
        remember(`show ${one.name}`, on ? "on" : "off");
      };
      actions.push({ label: `Show or hide: ${one.label}`, key: "", run: () => set(!one.on) });
      return h("label", { class: "switch", title: one.hint }, box, one.label);
    }));
  }
  const themes = choice("Theme", THEMES, chosenTheme, chooseTheme);
  for (const one of themes.children) actions.push({ label: `Theme: ${one.textContent!.toLowerCase()}`, key: "", run: () => (one as HTMLElement).click() });
  content.append(h("h2", { class: "heading", text: "Theme" }), themes);
  slot.append(...menu(content, "eye", "Show", "Show"));
  return actions;
}

/** Makes the buttons of the camera. Returns their actions, for keys. */
export function makeCamera(app: App, slot: HTMLElement, cameras: CameraAction[]): Action[] {
  const actions = cameras.map((camera) => {
    const { label, hint } = camera;
    const run = (): void => {
      camera.run();
      if (camera.on) made.setAttribute("aria-pressed", String(camera.on()));
      app.wake();
    };
    const made = button(icon(camera.icon), run, { class: "icon", "aria-label": label, title: `${label}: ${hint}`, ...(camera.on ? { "aria-pressed": "false" } : {}) });
    made.append(h("span", { class: "name", text: label }));
    return { label: `Camera: ${label}`, key: "", run, made };
  });
  const buttons = group("Camera", ...actions.map(({ made }) => made));
  buttons.classList.add("cameras");
  slot.append(...fold(buttons, "camera", "Camera", PHONE));
  return actions;
}
