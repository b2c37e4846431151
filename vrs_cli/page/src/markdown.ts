import { h } from "./dom";

/** Makes elements of a text in the Markdown of lessons: headings, paragraphs, lists, code, **bold**. It goes in as text alone. */
export function markdown(text: string): HTMLElement[] {
  const found: HTMLElement[] = [];
  for (const block of text.replace(/^```.*\n([\s\S]*?)^```$/gm, (_, code: string) => code.replace(/^/gm, "    ")).split(/\n\s*\n/)) {
    const lines = block.replace(/^\n+|\s+$/g, "").split("\n");
    const heading = /^#+ +(.*)$/.exec(lines[0]);
    if (heading) {
      found.push(h("h3", { class: "lesson-heading" }, ...runs(heading[1])));
      lines.shift();
    }
    if (!lines.length || !lines[0]) continue;
    if (lines.every((line) => line.startsWith("    "))) {
      const [last, code] = [found.at(-1), lines.map((line) => line.slice(4)).join("\n")];
      if (last?.tagName === "PRE") last.textContent += `\n${code}`;
      else found.push(h("pre", { class: "code lesson-code", text: code }));
    } else if (/^([-*]|\d+\.) /.test(lines[0])) {
      const items: string[] = [];
      for (const line of lines) {
        if (/^([-*]|\d+\.) /.test(line)) items.push(line.replace(/^([-*]|\d+\.) +/, ""));
        else items.push(`${items.pop()} ${line.trim()}`);
      }
      found.push(h("ul", { class: "lesson-list" }, ...items.map((item) => h("li", {}, ...runs(item)))));
    } else found.push(h("p", {}, ...runs(lines.join(" "))));
  }
  return found;
}

function runs(text: string): (Node | string)[] {
  return text.split(/(`[^`]+`|\*\*[^*]+\*\*)/).filter(Boolean).map((part) =>
    part.startsWith("`") && part.length > 2 ? h("code", { class: "code", text: part.slice(1, -1) })
      : part.startsWith("**") && part.length > 4 ? h("strong", { text: part.slice(2, -2) }) : part);
}
