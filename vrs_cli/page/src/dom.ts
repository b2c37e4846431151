type Props = Record<string, unknown>;

/** Makes an element with properties (`class`, `text`, `on...`, attributes) and children. Data goes in as text alone. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
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
