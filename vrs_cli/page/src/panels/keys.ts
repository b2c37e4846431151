import { button, h } from "../dom";
import { icon } from "../style/icons";
import type { Action } from "./bar";

const TYPED_IN = "input:not([type=checkbox], [type=range]), textarea, select, [contenteditable=true], .cm-editor";
/** Keys that these elements handle themselves. */
const OWN: [string, string[]][] = [
  ["button, [type=checkbox], summary, a", ["Space"]],
  ["[type=range], [role=separator], [role=tab], [data-slot=output], .list", ["Home", "End", "PageUp", "PageDown"]],
];

const keyOf = ({ key }: Action): HTMLElement => h("kbd", { text: key.replace("Page", "Page ") });

/** Makes the keys of the page, a list of them (?), and the search for actions (Ctrl-K). */
export function makeKeys(actions: Action[], slot: HTMLElement): void {
  const list: Action = { label: "All keys", key: "?", run: () => keys.showModal() };
  const find: Action = { label: "Find by name", key: "Ctrl-K", run: () => openPalette() };
  const all = [...actions, list, find];

  const rows = all.filter((action) => action.key).map((action) => h("tr", {}, h("th", { scope: "row" }, keyOf(action)), h("td", { text: action.label })));
  const keys: HTMLDialogElement = h("dialog", { class: "dialog", "aria-label": "Keys" },
    h("h2", { text: "Keys" }), h("table", {}, h("tbody", {}, ...rows)),
    h("p", { class: "note", text: "Keys belong to the page as long as nothing is typed in it. While the picture has the keyboard, the arrows move the camera, with Shift or Ctrl they turn it; + and - zoom." }),
    button("Close", () => keys.close()));

  const search = h("input", { class: "field", "aria-label": "What to do", placeholder: "What to do", role: "combobox", "aria-expanded": "true", "aria-controls": "palette", "aria-autocomplete": "list" });
  const found = h("ul", { class: "list", role: "listbox", id: "palette", "aria-label": "What can be done" });
  const palette = h("dialog", { class: "dialog palette", "aria-label": "Find by name" }, search, found);
  let matching: Action[] = [];
  let chosen = 0;
  function openPalette(): void {
    search.value = "";
    filter();
    palette.showModal();
  }
  function filter(): void {
    const words = search.value.toLowerCase().split(/\s+/);
    matching = all.filter(({ label }) => words.every((word) => label.toLowerCase().includes(word)));
    chosen = 0;
    found.replaceChildren(...matching.map((action, i) =>
      h("li", { role: "option", id: `palette-${i}`, onclick: () => run(action) }, h("span", { text: action.label }), keyOf(action))));
    mark();
  }
  function mark(): void {
    [...found.children].forEach((item, i) => item.setAttribute("aria-selected", String(i === chosen)));
    found.children[chosen]?.scrollIntoView({ block: "nearest" });
    search.setAttribute("aria-activedescendant", matching.length ? `palette-${chosen}` : "");
  }
  function run(action: Action): void {
    palette.close();
    action.run();
  }
  search.addEventListener("input", filter);
  search.addEventListener("keydown", (event) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (by && matching.length) chosen = (chosen + by + matching.length) % matching.length;
    else if (event.key === "Enter" && matching[chosen]) run(matching[chosen]);
    else return;
    event.preventDefault();
    mark();
  });
  for (const dialog of [keys, palette]) dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  document.body.append(keys, palette);
  slot.append(button(icon("keys"), list.run, { class: "icon quiet keys-button", "aria-label": "Keys", title: "All keys (?); find by name: Ctrl-K" }));

  const byKey = new Map(all.map((action) => [action.key.toLowerCase(), action]));
  addEventListener("keydown", (event) => {
    const target = event.target instanceof Element ? event.target : document.body;
    if ((event.ctrlKey || event.metaKey) && !event.altKey && event.key.toLowerCase() === "k") {
      event.preventDefault();
      if (!palette.open) openPalette();
      return;
    }
    if (event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey || target.closest(`${TYPED_IN}, dialog, .menu`)) return;
    const key = event.key === " " ? "Space" : event.key;
    if (OWN.some(([those, own]) => own.includes(key) && target.closest(those))) return;
    const action = byKey.get(key.toLowerCase());
    if (!action) return;
    event.preventDefault();
    action.run();
  });
}
