import { button } from "../dom";

/** Paths in a square of 16 by 16: lines of 1.5, or an area where the path begins with "*". */
const PATHS = {
  play: "*M4.5 2.6v10.8L13.2 8z", pause: "*M3.5 2.5h3.2v11H3.5zM9.3 2.5h3.2v11H9.3z",
  start: "*M2.5 2.5h2v11h-2zM13.5 2.8v10.4L5.5 8z", end: "*M11.5 2.5h2v11h-2zM2.5 2.8v10.4L10.5 8z",
  before: "M10 3 5 8l5 5", after: "M6 3l5 5-5 5", loop: "M12.6 5.2A5.2 5.2 0 0 0 3 6.6M3.4 10.8A5.2 5.2 0 0 0 13 9.4M12.9 2.4v3h-3M3.1 13.6v-3h3",
  slower: "*M8 3v10L1.6 8zM14.6 3v10L8.2 8z", faster: "*M1.4 3v10L7.8 8zM8 3v10l6.4-5z",
  zoom: "M7 2.5a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9zM10.3 10.3l3.4 3.4M5 7h4M7 5v4",
  side: "M2 3h12v10H2zM6.2 3v10", more: "*M2 6.7h2.6v2.6H2zM6.7 6.7h2.6v2.6H6.7zM11.4 6.7H14v2.6h-2.6z",
  eye: "M1.3 8S3.7 3.5 8 3.5 14.7 8 14.7 8 12.3 12.5 8 12.5 1.3 8 1.3 8zM8 6a2 2 0 1 0 0 4 2 2 0 0 0 0-4z",
  camera: "M2 5h8v6.5H2zM10 7.5l4-2v5.5l-4-2", front: "M3 3h10v10H3zM8 1v4M8 11v4", top: "M2.5 5.5 8 3l5.5 2.5L8 8zM2.5 5.5v5L8 13l5.5-2.5v-5",
  fit: "M2 6V2h4M10 2h4v4M14 10v4h-4M6 14H2v-4", home: "M2 8l6-5.5L14 8M3.7 6.8V13.5h8.6V6.8", tool: "M8 1.5v4M8 10.5v4M1.5 8h4M10.5 8h4M8 5.8a2.2 2.2 0 1 0 0 4.4 2.2 2.2 0 0 0 0-4.4z",
  right: "M4 2.5h8v11H4zM9.5 5.5 12 8l-2.5 2.5M1 8h11", keys: "M1.5 4h13v8h-13zM4 6.5h.5M6.5 6.5H7M9 6.5h.5M11.5 6.5h.5M4.5 9.5h7",
  close: "M3.5 3.5l9 9M12.5 3.5l-9 9",
} as const;
export type Icon = keyof typeof PATHS;

const LINES = { fill: "none", stroke: "currentColor", "stroke-width": "1.5", "stroke-linecap": "round", "stroke-linejoin": "round" };

function svg<K extends keyof SVGElementTagNameMap>(tag: K, attributes: Record<string, string>): SVGElementTagNameMap[K] {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [key, to] of Object.entries(attributes)) element.setAttribute(key, to);
  return element;
}

/** Makes an icon. It is hidden from screen readers, because its button has the name. */
export function icon(name: Icon): SVGSVGElement {
  const made = svg("svg", { viewBox: "0 0 16 16", width: "16", height: "16", "aria-hidden": "true", focusable: "false" });
  const style = PATHS[name].startsWith("*") ? { fill: "currentColor" } : LINES;
  made.append(svg("path", { d: PATHS[name].replace("*", ""), ...style }));
  return made;
}

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

/** Shows content in its place, or in a menu if there is no room. Returns its button and the content. */
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
