import { h } from "../dom";
import { type Icon, icon } from "./icons";

/** Makes a button that opens a menu, which closes by Escape or by a click elsewhere. Returns both. */
export function menu(content: HTMLElement, name: Icon, label: string, text = ""): [HTMLButtonElement, HTMLElement] {
  const button = h("button", { type: "button", class: text ? "button" : "button icon", "aria-label": label, title: label, "aria-expanded": "false" }, icon(name), text);
  content.classList.add("menu");
  content.setAttribute("popover", "auto");
  button.popoverTargetElement = content;
  content.addEventListener("beforetoggle", (event) => {
    button.setAttribute("aria-expanded", String((event as ToggleEvent).newState === "open"));
  });
  content.addEventListener("toggle", () => {
    if (!content.matches(":popover-open")) return;
    const at = button.getBoundingClientRect();
    const [width, height] = [content.offsetWidth, content.offsetHeight];
    const below = at.bottom + 4 + height <= innerHeight;
    content.style.left = `${Math.max(Math.min(at.left, innerWidth - width - 8), 8)}px`;
    content.style.top = `${below ? at.bottom + 4 : Math.max(at.top - height - 4, 8)}px`;
  });
  return [button, content];
}

/** Has content shown in its place, and where there is no room, in a menu. Returns its button and the content. */
export function fold(content: HTMLElement, name: Icon, label: string, narrow: MediaQueryList): [HTMLButtonElement, HTMLElement] {
  const [button] = menu(content, name, label);
  const arrange = (): void => {
    content.classList.toggle("menu", narrow.matches);
    button.hidden = !narrow.matches;
    if (narrow.matches) content.setAttribute("popover", "auto");
    else content.removeAttribute("popover");
  };
  narrow.addEventListener("change", arrange);
  arrange();
  return [button, content];
}
