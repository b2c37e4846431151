import type { App } from "../app";
import { h } from "../dom";

/** Makes a line of VAL-II and what was said of it. */
export function makePrompt(app: App, slot: HTMLElement, output: HTMLElement): void {
  const say = (text: string): void => output.append(h("div", { text }));
  const field = h("input", { "aria-label": "a line of VAL-II" });
  slot.append(h("form", { onsubmit: (event: Event) => { event.preventDefault(); void send(); } }, field));
  app.connection?.on("told", (message) => {
    for (const line of message.lines ?? []) say(line.map((run: [string, string]) => run[0]).join(""));
  });
  async function send(): Promise<void> {
    const text = field.value;
    field.value = "";
    say(`. ${text}`);
    const done = await app.connection!.ask("line", { text });
    if (done.refusal) say(done.refusal.message);
  }
}
