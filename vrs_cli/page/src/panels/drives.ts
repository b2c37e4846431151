import { h } from "../dom";
import type { Commands } from "./commands";

const NO_CONNECTION = "No connection to the robot: it is tried again";

/** Makes the row that says who drives, and lets this user ask for it or give it; and what is under way. */
export function makeDrives(commands: Commands, slot: HTMLElement): void {
  const who = h("span", {});
  const news = h("span", { class: "note drives-news" });
  const buttons = h("span", { class: "row" });
  const row = h("div", { class: "row spread drives", role: "status" }, h("span", {}, who, " ", news), buttons);
  const offer = (label: string, act: string, to = ""): HTMLElement =>
    h("button", { class: "button", type: "button", text: label, onclick: () => commands.drive(act, to) });
  let drawn = "";
  commands.onChange(() => {
    const { lease, name, open } = commands;
    const alone = commands.connection.welcome!.one_user && !lease.driver;
    const under = commands.underWay;
    const said = !open ? NO_CONNECTION : under ? `Under way: ${under.split("\n")[0].slice(0, 60)}` : "";
    const text = JSON.stringify([lease, name, open, alone, said]);
    if (text === drawn) return;
    drawn = text;
    who.textContent = alone ? "" : commands.whoDrives();
    news.textContent = said;
    news.classList.toggle("bad", !open);
    buttons.replaceChildren();
    if (commands.moves && open && !alone) {
      if (!lease.driver) buttons.append(offer("Drive", "acquire"));
      else if (lease.driver !== name) buttons.append(offer("Ask to drive", "ask"));
      else {
        if (lease.asking) buttons.append(offer(`Give to ${lease.asking}`, "give", lease.asking));
        buttons.append(offer("Let others drive", "release"));
      }
    }
    if (row.textContent?.trim()) slot.replaceChildren(row);
    else slot.replaceChildren();
  });
}
