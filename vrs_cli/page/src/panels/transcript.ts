import { remember, rememberedValue } from "../core/storage";
import { button, h } from "../dom";
import { type Run, scan } from "./language";

const MAX_LINES = 2000; // maximum lines in the document
const MAX_LINE_CHARS = 4000;
const MAX_KEPT_LINES = 400; // maximum lines that survive a reload
const MAX_KEPT_CHARS = 200_000;
const [MIN_COLUMNS, MAX_COLUMNS] = [28, 200]; // limits of the columns of replies
const MARGIN = 32; // [px] of the columns: padding, and the bar that scrolls
const ofTab = (): Storage => sessionStorage;
const NEAR_END = 24; // [px] from the end within which the newest line is followed

/** Returns the number of columns of a transcript at the current width of its slot. */
export function columnsOf(slot: HTMLElement): number {
  const ruler = h("div", { class: "transcript", style: "position: absolute; visibility: hidden; padding: 0", text: "m".repeat(100) });
  slot.append(ruler);
  ruler.style.whiteSpace = "nowrap";
  const columns = Math.floor((slot.clientWidth - MARGIN) / (ruler.getBoundingClientRect().width / 100));
  ruler.remove();
  return Number.isFinite(columns) && columns > 0 ? Math.min(Math.max(columns, MIN_COLUMNS), MAX_COLUMNS) : MIN_COLUMNS;
}

/** The transcript: a bounded list of lines of styled runs, the newest last, which survives a reload. */
export class Transcript {
  private lines: { runs: Run[]; element?: HTMLElement }[] = [];
  private again = { key: "", from: 0 };
  private open = false;
  private drawing = 0;
  private following = true;
  private readonly list = h("div", { class: "transcript" });
  private readonly newest = button("↓ Newest", () => this.toEnd(), { class: "transcript-newest", hidden: true });

  /** `name`: the key under which lines are stored for a reload. */
  constructor(private readonly slot: HTMLElement, private readonly name: string) {
    slot.append(this.list, this.newest);
    slot.addEventListener("scroll", () => this.follow(slot.scrollHeight - slot.scrollTop - slot.clientHeight < NEAR_END));
    new ResizeObserver(() => this.following && this.toEnd()).observe(slot);
    window.addEventListener("pagehide", () => this.keep());
    document.addEventListener("visibilitychange", () => document.hidden && this.keep());
    this.say(rememberedValue<Run[][]>(name, [], ofTab));
  }

  /** Adds typed lines. `again`: a key; of consecutive lines with the same key only the last stays. */
  echo(prompt: string, text: string, again = ""): void {
    if (again && again === this.again.key) this.lines.splice(this.again.from).forEach((line) => line.element?.remove());
    const from = this.lines.length;
    for (const line of text.split("\n")) this.add([[prompt, "note"], ...scan(line).map(([said, ink]): Run => [said, `${ink} typed`])]);
    this.again = { key: again, from };
  }

  /** Adds lines of runs, as replies have them. */
  say(lines: Run[][]): void {
    for (const runs of lines) this.add(runs);
  }

  /** Adds lines in one ink. */
  note(text: string, ink = "note"): void {
    this.say(text.split("\n").map((line) => [[line, ink]]));
  }

  /** Adds what a program TYPEs; a line may come in parts. */
  type(text: string, newline: boolean): void {
    const [first, ...others] = text.split("\n");
    const last = this.lines[this.lines.length - 1];
    if (this.open && last) {
      last.runs = shortened([[last.runs[0][0] + first, "text"]]);
      if (last.element) fill(last.element, last.runs);
      this.draw();
    } else this.add([[first, "text"]]);
    if (others.length) this.note(others.join("\n"), "text");
    this.open = !newline;
  }

  private add(runs: Run[]): void {
    this.open = false;
    this.again = { key: "", from: 0 };
    this.lines.push({ runs: shortened(runs) });
    this.draw();
  }

  /** Draws new lines at the next frame; lines that would be removed at once are never drawn. */
  private draw(): void {
    if (this.lines.length > 2 * MAX_LINES) this.drop();
    if (this.drawing) return;
    this.drawing = window.setTimeout(() => {
      this.drawing = 0;
      this.drop();
      const fresh = this.lines.filter((line) => !line.element);
      for (const line of fresh) fill((line.element = h("div", {})), line.runs);
      this.list.append(...fresh.map((line) => line.element!));
      if (this.following) this.toEnd();
      else this.newest.hidden = false;
    }, 30);
  }

  private drop(): void {
    const gone = this.lines.splice(0, Math.max(this.lines.length - MAX_LINES, 0));
    for (const { element } of gone) element?.remove();
    this.again.from -= gone.length;
    if (this.again.from < 0) this.again = { key: "", from: 0 };
  }

  private follow(following: boolean): void {
    this.following = following;
    if (following) this.newest.hidden = true;
  }

  private toEnd(): void {
    this.slot.scrollTop = this.slot.scrollHeight;
    this.follow(true);
  }

  private keep(): void {
    const lines = this.lines.slice(-MAX_KEPT_LINES).map((line) => line.runs);
    while (JSON.stringify(lines).length > MAX_KEPT_CHARS) lines.splice(0, Math.ceil(lines.length / 4));
    remember(this.name, JSON.stringify(lines), ofTab); // without room, the earlier lines stay stored
  }
}

function fill(element: HTMLElement, runs: Run[]): void {
  element.replaceChildren(...runs.map(([text, ink]) => h("span", { class: ink.split(" ").map((one) => `ink-${one}`).join(" "), text })));
}

function shortened(runs: Run[]): Run[] {
  let left = MAX_LINE_CHARS;
  const shown: Run[] = [];
  for (const [text, ink] of runs) {
    if (left > 0) shown.push([text.length > left ? `${text.slice(0, left)} ...` : text, String(ink)]);
    left -= text.length;
  }
  return shown;
}
