import type { Part, Shown } from "../app";
import { Change } from "../core/change";
import { button, h } from "../dom";
import type { Commands } from "./commands";

const ALWAYS = 8; // signals of a bank that are always shown
const MAX_SHOWN = 64; // maximum number of displayed signals of a bank
const BANKS = [["Outputs", 1, 1000, ALWAYS], ["Inputs", 1001, 2000, ALWAYS], ["Internal", 2001, 3000, 0]] as const;

/** Makes the tab of signals: each is a lamp, and a switch for users who may drive. The names are those of the cell. */
export function makeSignals(commands: Commands, slot: HTMLElement): Part {
  const names: Record<string, string> = commands.connection.welcome!.cell?.names ?? {};
  const stack = h("div", { class: "stack signals" });
  slot.append(stack);
  const change = new Change();
  return {
    show({ surveyed }: Shown): void {
      if (!surveyed) return;
      const on: number[] = surveyed.on;
      const may = commands.mayDrive && commands.supervises;
      if (!change.to([on, may])) return;
      const focused = (document.activeElement as HTMLElement | null)?.dataset.signal;
      stack.replaceChildren(...BANKS.map(([title, first, last, always]) => {
        const usual = Array.from({ length: always }, (_, i) => first + i);
        const known = [...new Set([...usual, ...Object.keys(names).map(Number), ...on])];
        const there = known.filter((one) => one >= first && one <= last).sort((a, b) => a - b);
        const lamps = there.slice(0, MAX_SHOWN).map((number) => lamp(number, on.includes(number), may));
        const more = there.length - lamps.length;
        return h("section", { hidden: !there.length }, h("h2", { class: "heading", text: title }), h("div", { class: "signal-grid" }, ...lamps),
          more > 0 ? h("p", { class: "note", text: `and ${more} more: IO lists them` }) : "");
      }));
      if (focused) stack.querySelector<HTMLElement>(`[data-signal="${focused}"]`)?.focus();
    },
  };
  function lamp(number: number, on: boolean, may: boolean): HTMLElement {
    const name = names[number] ?? "";
    const made = button(h("span", { class: `lamp ${on ? "on" : ""}` }), () => commands.command(`SIGNAL ${on ? -number : number}`, "SIGNAL"), {
      class: "signal", disabled: !may, "aria-pressed": String(on), "data-signal": String(number),
      "aria-label": `Signal ${number}${name ? ` ${name}` : ""}`, title: `${name || `Signal ${number}`} is ${on ? "on" : "off"}`,
    });
    made.append(h("span", { class: "number", text: String(number) }), name ? h("span", { class: "note signal-name", text: name }) : "");
    return made;
  }
}
