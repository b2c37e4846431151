import type { App } from "../app";
import { Change } from "../core/change";
import type { Connection, Message } from "../core/connection";
import { remember, rememberedValue } from "../core/storage";
import { type Survey, withoutTime } from "../core/survey";
import type { Transcript } from "./transcript";

const MAX_SENT_CHARS = 50_000; // maximum size of one typed text
const MAX_HISTORY = 500; // lines
const A_WHILE = 0.5; // [s] duration after which a command is displayed as running

/** The user's commands to the robot and their replies, shared by all panels that drive. */
export class Commands {
  /** Who has the lease, and who has asked this user for it; "" for nobody. */
  lease = { driver: "", asking: "" };
  status: Message = { prompt: "." };
  history: string[];
  /** Opens a program in the editor, as SEE does, with the cursor in a row (from 0). */
  see: (name: string, row: number) => void = () => {};
  /** Called with each reply and each refused line, for pictures of WHY. */
  replied: (told: Message) => void = () => {};
  refused: (text: string) => void = () => {};
  /** Called when a stop is sent, anybody has stopped the robot, or the connection is cut: drop motions that are not sent. */
  stopped: () => void = () => {};
  private readonly questions = new Map<number, Message>();
  private readonly waiting = new Map<number, { text: string; since: number }>();
  private readonly listeners = new Set<() => void>();
  private readonly heard = new Change();
  private attends = false;
  private cuts = false;
  private count = 0;

  constructor(readonly app: App, readonly connection: Connection, readonly survey: Survey, readonly transcript: Transcript) {
    this.history = rememberedValue(this.historyName, []);
    connection.on("told", (told) => {
      if (told.lines) transcript.say(told.lines);
      this.replied(told);
    });
    connection.on("typed", (typed) => transcript.type(typed.text, typed.newline ?? true));
    connection.on("asked", (asked) => this.asked(asked));
    connection.on(["change", "pulled"], ({ delta, state }) => (delta?.motion.text === "BRAKE" || state?.why) && this.stopped());
    connection.on("withdrawn", ({ number }) => this.questions.delete(number) && this.changed());
    connection.on("status", ({ around }) => this.heed(around));
    connection.on("activity", ({ driver }) => this.leased({ driver: driver ?? "" }));
    connection.on("lease", (told) => this.hearLease(told));
    connection.on("state", ({ state }) => {
      this.cuts ||= state === "cut";
      if (!this.open) this.stopped();
      this.changed();
    });
    connection.on("welcome", (welcome) => this.welcomed(welcome));
    this.welcomed(connection.welcome!);
  }

  /** Calls `changed` when the lease, questions, the status or the connection changes. */
  onChange(changed: () => void): void {
    this.listeners.add(changed);
    changed();
  }

  // --- rights ---

  get open(): boolean {
    return this.connection.state === "open";
  }
  get name(): string {
    return this.connection.welcome!.name;
  }
  /** Whether this user's role may move the robot. */
  get moves(): boolean {
    return this.connection.welcome!.role !== "observer";
  }
  /** Whether this user's role may change programs and settings. */
  get supervises(): boolean {
    return ["supervisor", "teacher"].includes(this.connection.welcome!.role);
  }
  /** Whether this user may move the robot now: nobody else drives. */
  get mayDrive(): boolean {
    return this.moves && this.open && ["", this.name].includes(this.lease.driver);
  }
  get question(): Message | undefined {
    return this.questions.values().next().value;
  }
  /** The command that has been running for a while; "" for none. */
  get underWay(): string {
    const [first] = [...this.waiting.values()].filter(({ text }) => text);
    return first && performance.now() / 1000 > first.since + A_WHILE ? first.text : "";
  }
  /** Whether a command with this beginning is unfinished. */
  waits(beginning: string): boolean {
    return [...this.waiting.values()].some(({ text }) => text.startsWith(beginning));
  }
  whoDrives(driver = this.lease.driver): string {
    return driver === this.name ? "You drive" : `${driver || "Nobody"} drives`;
  }

  // --- what is done ---

  /** Sends lines that were typed. */
  type(text: string): void {
    if (text.length > MAX_SENT_CHARS) return this.note(`${text.length} characters at once: load them as a file`, "error");
    this.remember(text);
    void this.command(text);
  }

  /** Sends a typed line, or the line of a button. The result says whether it was done. */
  async command(text: string, again = ""): Promise<Message> {
    if (!this.open) {
      this.note(`Not given, for there is no connection to the robot: ${text.trim()}`, "warning");
      return { ok: false };
    }
    if (/\bab/i.test(text)) this.stopped(); // ABORT, maybe abbreviated
    this.transcript.echo(`${this.status.prompt?.trim() || "."} `, text, again);
    return this.do("line", { text }, text);
  }

  /** Carries out an act. A refusal is displayed and returned. */
  act(act: Message, text = ""): Promise<Message> {
    return this.do("at", { act }, text);
  }

  /** Puts the programs of a text in memory. */
  async load(name: string, text: string): Promise<boolean> {
    this.note(`Loading ${name}`);
    const end = await this.act({ kind: "Define", text, where: `${name}:` });
    if (end.found?.names) this.note(`In memory: ${end.found.names.join(", ") || "no program"}`);
    return !!end.found;
  }

  drive(act: string, to = ""): void {
    void this.do("drive", { act, ...(to ? { to } : {}) }, "");
  }

  answer(asked: Message, value: boolean | string | null, how = "answered"): void {
    if (!this.open) return this.note("There is no connection to the robot: the question stays open", "error");
    if (!this.questions.delete(asked.number)) return;
    const said = typeof value === "boolean" ? (value ? "Y" : "N") : (value ?? "");
    this.transcript.echo(`${asked.question.text ?? ""} `, how === "answered" ? said : "^C");
    this.connection.send({ type: "answer", question: asked.number, value, how });
    this.changed();
  }

  note(text: string, ink = "note"): void {
    this.transcript.note(text, ink);
  }

  /** Keeps a line in the history. */
  remember(text: string): void {
    if (!text.trim() || text === this.history[this.history.length - 1]) return;
    this.history = [...this.history, text].slice(-MAX_HISTORY);
    remember(this.historyName, JSON.stringify(this.history)); // without room it lasts as long as the page
  }

  private get historyName(): string {
    return `history ${this.connection.welcome!.robot}`;
  }

  private async do(type: string, fields: Message, text: string): Promise<Message> {
    const number = ++this.count;
    this.waiting.set(number, { text, since: performance.now() / 1000 });
    setTimeout(() => this.changed(), 1000 * A_WHILE + 50);
    const end = await this.connection.ask(type, fields);
    this.waiting.delete(number);
    this.survey.happened();
    if (end.refusal) this.note(end.refusal.message, "error");
    if (end.status) {
      this.attends = false;
      this.heed(end.status);
    }
    if (text && (end.refusal || end.ok === false)) this.refused(text);
    this.changed();
    return end;
  }

  // --- what comes ---

  private changed(): void {
    for (const listener of this.listeners) listener();
    this.app.wake();
  }

  private welcomed(welcome: Message): void {
    if (!welcome.resumed) this.questions.clear();
    if (this.cuts) this.note("connected again");
    this.cuts = this.attends = false;
    this.attend();
    this.changed();
    if (welcome.first_line) this.type(welcome.first_line);
  }

  /** Asks the server to put questions of programs to this user. */
  private attend(): void {
    if (this.attends || !this.moves || !this.open) return;
    this.attends = true;
    void this.do("at", { act: { kind: "Attend" } }, "");
  }

  /** Receives the status of the robot, which arrives each second. */
  private heed(status: Message): void {
    this.status = status;
    this.leased({ driver: status.driver ?? "" });
    if (status.asked && !this.question) this.attend();
  }

  private leased(lease: { driver: string; asking?: string }): void {
    this.lease = { ...this.lease, ...lease };
    if (this.heard.to([this.lease, withoutTime(this.status)])) this.changed();
  }

  private asked(asked: Message): void {
    const { kind, name, row } = asked.question;
    if (["Editing", "Jogging", "Watching"].includes(kind)) {
      // the page has a screen for it all the time: the command ends at once
      this.connection.send({ type: "answer", question: asked.number, value: "" });
      if (kind === "Editing") this.see(name, row);
      if (kind === "Jogging") openTab("Move");
    } else if (kind === "Playing") this.connection.send({ type: "answer", question: asked.number, value: null });
    else this.questions.set(asked.number, asked);
    this.changed();
  }

  /** Displays who drives, and notices of the lease. */
  private hearLease({ holder = "", notice }: Message): void {
    const before = this.lease;
    let asking = holder === before.driver ? before.asking : "";
    const { kind, of, by } = notice ?? {};
    const concerns = of === this.name;
    if (kind === "Requested" && concerns) {
      asking = by;
      this.note(`${by} would like to drive`, "warning");
    } else if (kind === "Requested") this.note(`${of} is asked to let ${by === this.name ? "you" : by} drive`);
    else if (kind === "Lost" && concerns) this.note(`${by} drives, for nothing was heard of you`, "warning");
    else if (holder !== before.driver && !this.connection.welcome!.one_user) this.note(this.whoDrives(holder));
    this.leased({ driver: holder, asking });
  }
}

/** Opens a tab of the page by its name. */
export function openTab(name: string): void {
  document.getElementById(`to-${name}`)?.click();
}
