import { button } from "../dom";
import { type Icon, icon } from "./icons";

/** Makes a button that opens a menu, which closes by Escape or by a click elsewhere. Returns both. */
export function menu(content: HTMLElement, name: Icon, label: string, text = ""): [HTMLButtonElement, HTMLElement] {
  const made = button(icon(name), () => {}, { class: text ? "" : "icon", "aria-label": label, title: label, "aria-expanded": "false" });
  made.append(text);
  content.classList.add("menu");
  content.setAttribute("popover", "auto");
  made.popoverTargetElement = content;
  content.addEventListener("beforetoggle", (event) => (made.ariaExpanded = String((event as ToggleEvent).newState === "open")));
  content.addEventListener("toggle", () => {
    if (!content.matches(":popover-open")) return;
    const at = made.getBoundingClientRect();
    const [width, height] = [content.offsetWidth, content.offsetHeight];
    const below = at.bottom + 4 + height <= innerHeight;
    content.style.left = `${Math.max(Math.min(at.left, innerWidth - width - 8), 8)}px`;
    content.style.top = `${below ? at.bottom + 4 : Math.max(at.top - height - 4, 8)}px`;
  });
  return [made, content];
}

/** Has content shown in its place, and where there is no room, in a menu. Returns its button and the content. */
export function fold(content: HTMLElement, name: Icon, label: string, narrow: MediaQueryList): [HTMLButtonElement, HTMLElement] {
  const [opener] = menu(content, name, label);
  const arrange = (): void => {
    content.classList.toggle("menu", narrow.matches);
    opener.hidden = !narrow.matches;
    content.popover = narrow.matches ? "auto" : null;
  };
  narrow.addEventListener("change", arrange);
  arrange();
  return [opener, content];
}
