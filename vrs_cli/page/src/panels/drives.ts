import { Change } from "../core/change";
import { button, h } from "../dom";
import type { Commands } from "./commands";

const NO_CONNECTION = "No connection to the robot: it is tried again";

/** Makes the row that says who drives, and lets this user ask for it or give it; and what is under way. */
export function makeDrives(commands: Commands, slot: HTMLElement): void {
  const offer = (label: string, act: string, to = ""): HTMLElement => button(label, () => commands.drive(act, to));
  const row = h("div", { class: "row spread drives", role: "status" });
  const change = new Change();
  commands.onChange(() => {
    const { lease, name, open } = commands;
    const alone = commands.connection.welcome!.one_user && !lease.driver;
    const under = commands.underWay;
    const said = !open ? NO_CONNECTION : under ? `Under way: ${under.split("\n")[0].slice(0, 60)}` : "";
    if (!change.to([lease, name, open, alone, said])) return;
    const buttons: HTMLElement[] = [];
    if (commands.moves && open && !alone) {
      if (!lease.driver) buttons.push(offer("Drive", "acquire"));
      else if (lease.driver !== name) buttons.push(offer("Ask to drive", "ask"));
      else {
        if (lease.asking) buttons.push(offer(`Give to ${lease.asking}`, "give", lease.asking));
        buttons.push(offer("Let others drive", "release"));
      }
    }
    const news = h("span", { class: `note drives-news ${open ? "" : "bad"}`, text: said });
    row.replaceChildren(h("span", {}, alone ? "" : commands.whoDrives(), " ", news), h("span", { class: "row" }, ...buttons));
    slot.replaceChildren(...(row.textContent?.trim() ? [row] : []));
  });
}
