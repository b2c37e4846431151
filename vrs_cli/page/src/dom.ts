type Props = Record<string, unknown>;
type Child = Node | string;

/** Makes an element with properties (`class`, `text`, `on...`, attributes) and children. Data is inserted as text only. */
export function h<K extends keyof HTMLElementTagNameMap>(tag: K, props: Props = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, to] of Object.entries(props)) {
    if (name === "text") element.textContent = String(to);
    else if (name === "class") element.className = String(to);
    else if (name.startsWith("on")) element.addEventListener(name.slice(2), to as EventListener);
    else if (typeof to === "boolean") element.toggleAttribute(name, to);
    else element.setAttribute(name, String(to));
  }
  element.append(...children);
  return element;
}

/** Makes a button with a text or an icon, and its action. `props`: as of `h`; a class is added to "button". */
export function button(shown: Child, act: () => unknown, props: Props = {}): HTMLButtonElement {
  return h("button", { type: "button", ...props, class: `button ${props.class ?? ""}`.trim(), onclick: () => void act() }, shown);
}

/** Makes a group of buttons with a label for screen readers. */
export const group = (label: string, ...buttons: Child[]): HTMLElement => h("div", { class: "group", role: "group", "aria-label": label }, ...buttons);

/** Makes a group of buttons; that of `chosen` is pressed. `names`: their texts. */
export function choice<T extends string>(label: string, names: Record<T, string>, chosen: () => T, choose: (name: T) => void): HTMLElement {
  const entries = Object.entries(names) as [T, string][];
  const buttons = entries.map(([name, text]) => button(text, () => (choose(name), mark())));
  const mark = (): void => buttons.forEach((one, i) => one.setAttribute("aria-pressed", String(entries[i][0] === chosen())));
  mark();
  return group(label, ...buttons);
}

/** Sets the text of an element if it differs, because setting an equal text costs as much. */
export function put(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** Sets properties of an element if they differ. */
export function assign<T extends object>(element: T, values: Partial<T>): void {
  for (const name in values) if (element[name] !== values[name]) element[name] = values[name]!;
}
