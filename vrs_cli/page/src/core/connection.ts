import type { Model } from "./kinematics";
import { Timeline } from "./timeline";

/** A message of the protocol (docs/protocol.md), by its fields. */
// eslint-disable-next-line @typescript-eslint/no-explicit-any
export type Message = Record<string, any>;

export interface Welcome extends Message {
  robot: string;
  role: string;
  name: string;
  model: Model;
  life: string;
}

export type ConnectionState = "opening" | "open" | "cut" | "refused";

/** What a connection needs of a WebSocket. */
export type Socket = Pick<WebSocket, "readyState" | "send" | "close" | "onopen" | "onmessage" | "onclose">;

/** Options of a connection, for tests and for pages that follow many robots. */
export interface Options {
  /** Fields of `hello` in place of the usual ones. */
  hello?: Message;
  /** Returns the number of columns for replies, at each connection. */
  columns?: () => number;
  /** The first subscription; null: none. */
  follow?: Message | null;
  connect?: (url: string) => Socket;
  /** The time of this machine [s]. */
  wall?: () => number;
}

const COMMANDS = new Set(["abort", "at", "drive", "line", "put", "askhelp", "handin", "watchclass", "announce", "freeze"]);
const NUMBERED = new Set(["alarm", "asked", "done", "refused", "told", "typed", "withdrawn", "lease", "announced", "lessontext"]);
const OPEN = 1; // WebSocket.OPEN
const FOLLOWED = { deltas: true, world: true, measured: true, window: 600 }; // the first subscription; `window`: seconds of the past
const PING = 2; // [s] between two pings
const FIRST_PINGS = [0, 0.1, 0.1, 0.2, 0.4]; // [s] before each of the first pings, so that the clock is soon right
const SILENT = 10; // [s] without any message after which the connection is dead
const HELD_UP = 3; // [s] maximum age of a command on arrival, beside the usual trip
const SOONEST = 0.3; // [s] before the first attempt to reconnect; each later wait is up to twice as long
const LATEST = 10; // [s]
const MAX_WAITING = 1000; // requests without an answer
const MAX_CHARS = 2_000_000; // maximum size of a message to the server

const OFFLINE = refusal("there is no connection: this was not sent", "give it again when the connection is back");
const UNSEEN = refusal("the connection was cut before it came to the robot: it was not done", "give it again");
const UNKNOWN = refusal("nobody knows whether it was done", "look before you give it again: the server began anew");
const TOO_LONG = refusal(`it is longer than ${MAX_CHARS} characters`, "give it in parts");
const TOO_MANY = refusal(`${MAX_WAITING} requests wait already`, "wait for some answers first");

/** A client of one robot, by docs/protocol.md: it keeps the timeline and the clock over all its sockets, one after the
 * other. After a lost connection it repeats no command: a command that never reached the robot ends with a refusal. */
export class Connection {
  readonly timeline = new Timeline();
  /** The questions that wait for an answer, by number. */
  readonly questions = new Map<number, Message>();
  welcome: Welcome | null = null;
  state: ConnectionState = "opening";
  /** Why the connection was refused, or closed by the server. */
  why = "";
  private clock: Message = { now: 0 };
  private readonly serverClock = new ServerClock();
  private readonly listeners = new Map<string, Set<(message: Message) => void>>();
  private readonly waiting = new Map<number, { request: Message; done: (answer: Message) => void }>();
  private parts: Message[] = [];
  private followed: Message | null;
  private change: number | null = null;
  private ids = 0;
  private seq = 0;
  private attempts = 0; // attempts to connect since the last welcome
  private welcomed = false; // whether this socket has had its welcome
  private left = false;
  private heardAt: number;
  private timer = 0; // timer of the next ping or attempt to connect
  private columns = 0; // number of columns for replies
  private socket!: Socket;
  private readonly wall: () => number;

  constructor(readonly url: string, private readonly token: string, private readonly name: string, private readonly options: Options = {}) {
    this.wall = options.wall ?? (() => performance.now() / 1000);
    this.heardAt = this.wall();
    this.followed = options.follow === undefined ? FOLLOWED : options.follow;
    this.open();
    if (typeof document !== "undefined" && !options.connect) this.watchPage();
  }

  /** Calls `heard` with each message of some topics: types of messages, "state" of the connection, "change" of the
   * timeline. Returns a function that ends it. */
  on(topics: string | string[], heard: (message: Message) => void): () => void {
    const sets = [topics].flat().map((topic) => this.listeners.get(topic) ?? this.listeners.set(topic, new Set()).get(topic)!);
    for (const set of sets) set.add(heard);
    return () => sets.forEach((set) => set.delete(heard));
  }

  /** Sends a message that needs no answer; returns false, and never sends it, without a connection. */
  send(message: Message): boolean {
    if (this.state !== "open" || this.socket.readyState !== OPEN) return false;
    if (message.type === "answer") this.questions.delete(message.question); // a lost answer is asked for again
    const hurries = message.type === "answer" || (COMMANDS.has(message.type) && message.type !== "abort");
    const { trip } = this.serverClock;
    const until = hurries && trip < Infinity ? { until: this.serverNow + trip + HELD_UP } : {};
    this.socket.send(JSON.stringify({ ...message, ...until }));
    return true;
  }

  /** Sends a command or a request. Returns what ends it (done, refused, located, ...), a refusal at once where there is
   * no connection. */
  ask(type: string, fields: Message = {}): Promise<Message> {
    const id = ++this.ids;
    const request: Message = { type, id, ...fields };
    const refused = (why: Message): Promise<Message> => Promise.resolve({ type: "refused", id, refusal: why });
    if (this.waiting.size >= MAX_WAITING && type !== "abort") return refused(TOO_MANY);
    if (JSON.stringify(request).length > MAX_CHARS) return refused(TOO_LONG);
    if (!this.send(request)) return refused(OFFLINE);
    return new Promise((done) => this.waiting.set(id, { request, done }));
  }

  /** Replaces the subscription; it stays valid after a reconnection. */
  follow(fields: Message): Promise<Message> {
    this.change = fields.after ?? null;
    const answer = this.ask("subscribe", fields);
    this.followed = { ...fields, id: this.ids };
    return answer;
  }

  /** Asks for the unknown part of the timeline from `begin` [s] on. Returns whether more of it is known now. */
  async recall(begin: number): Promise<boolean> {
    for (let attempt = 0; attempt < 3; attempt++) {
      const { timeline } = this;
      if (timeline.first === 0 || begin >= timeline.begin) return false;
      const answer = await this.ask("window", { begin: Math.max(begin, 0), end: timeline.begin });
      if (answer.type !== "shown") return false;
      if (timeline.prepend(answer.snapshot, answer.number ?? 0)) {
        this.tell("change", answer);
        return true;
      }
    }
    return false; // others change the timeline faster than parts arrive
  }

  /** The robot's clock, now [s]. */
  now(): number {
    return this.robotAt(this.serverNow);
  }
  /** The robot's clock [s] when the server's clock shows `wall` [s]. */
  robotAt(wall: number): number {
    return robotClock(this.clock, wall);
  }
  /** Whether the robot's clock runs by itself. */
  get passes(): boolean {
    return !!this.clock.realtime && !this.clock.paused;
  }
  /** The robot's clock [s] when a command that is sent now has come, by the slowest way of the last minute; null where the
   * clock does not go on by itself. */
  get arrival(): number | null {
    return this.passes ? this.robotAt(this.serverNow + this.serverClock.forward) : null;
  }
  private get serverNow(): number {
    return this.serverClock.there(this.wall());
  }

  /** Leaves for good, so that the server forgets this client at once. */
  leave(): void {
    this.left = true;
    this.send({ type: "bye" });
    this.socket.close();
    clearTimeout(this.timer);
  }

  // --- sockets ---

  private open(): void {
    clearTimeout(this.timer);
    this.welcomed = false;
    const socket = (this.socket = this.options.connect?.(this.url) ?? new WebSocket(this.url));
    socket.onopen = () => {
      this.heardAt = this.wall();
      socket.send(JSON.stringify(this.hello()));
    };
    socket.onmessage = (event) => {
      if (socket !== this.socket) return;
      this.heardAt = this.wall();
      this.receive(JSON.parse(event.data as string));
    };
    socket.onclose = () => {
      if (socket === this.socket) this.cut();
    };
  }

  private hello(): Message {
    const unanswered = [...this.waiting].filter(([, { request }]) => COMMANDS.has(request.type)).map(([id]) => id);
    const resume = this.welcome && { connection: this.welcome.connection, seq: this.seq, ...(unanswered.length ? { unanswered } : {}) };
    return {
      type: "hello", versions: [1], name: this.name,
      ...(this.options.hello ?? { full: true, attended: true, rendered: (this.columns = this.options.columns?.() ?? 100) }),
      ...(this.token ? { token: this.token } : {}), ...(resume ? { resume } : {}),
    };
  }

  private cut(): void {
    clearTimeout(this.timer);
    if (this.state === "refused") return;
    this.become("cut");
    if (this.left || this.options.connect) return; // a test opens the next socket itself
    const wait = Math.random() * Math.min(LATEST, SOONEST * 2 ** this.attempts++);
    this.later(wait, () => this.open());
  }

  /** Tells the server the current number of columns for replies. */
  resized(): void {
    const columns = this.options.columns?.() ?? this.columns;
    if (columns !== this.columns && this.send({ type: "screen", columns })) this.columns = columns;
  }

  /** Connects again now. */
  reopen(): void {
    const old = this.socket;
    old.onclose = old.onmessage = old.onopen = null;
    old.close();
    if (this.state === "open") this.become("cut");
    this.open();
  }

  /** Checks the connection when a sleeping page wakes up. */
  private watchPage(): void {
    const wake = (): void => {
      if (this.left || this.state === "refused" || document.hidden) return;
      if (this.state !== "open") return this.attempts > 0 ? this.reopen() : undefined;
      this.ping();
      const since = this.wall();
      setTimeout(() => this.state === "open" && this.heardAt < since && this.reopen(), 3000);
    };
    document.addEventListener("visibilitychange", wake);
    addEventListener("online", wake);
    addEventListener("pagehide", () => this.leave());
    addEventListener("pageshow", (event) => {
      if (!event.persisted) return;
      this.left = false;
      this.reopen();
    });
  }

  private later(seconds: number, act: () => void): void {
    this.timer = setTimeout(act, 1000 * seconds) as unknown as number;
  }

  private ping(): void {
    this.send({ type: "ping", sent: this.wall() });
  }

  /** Sends pings after some waits [s], and then regularly; reconnects if nothing comes back. */
  private pulse(wait = PING, ...waits: number[]): void {
    this.later(wait, () => {
      if (this.wall() - this.heardAt > SILENT && !document.hidden) return this.reopen();
      this.ping();
      this.pulse(...waits);
    });
  }

  // --- what comes ---

  private become(state: ConnectionState): void {
    this.state = state;
    this.tell("state", { state, why: this.why });
  }

  private tell(topic: string, message: Message): void {
    for (const heard of [...(this.listeners.get(topic) ?? [])]) heard(message);
  }

  private receive(message: Message): void {
    if (message.type === "closing") {
      this.why = message.refusal?.message ?? message.why ?? "";
      this.tell("closing", message);
      if (!this.welcomed && message.refusal) this.become("refused"); // another attempt would be refused too
      return;
    }
    if (!this.welcomed) return message.type === "welcome" ? this.begin(message as Welcome) : undefined;
    if (typeof message.seq === "number" && (NUMBERED.has(message.type) || message.seq > 0)) {
      if (message.seq <= this.seq) return;
      if (message.seq !== this.seq + 1) return this.reopen(); // a resumed connection brings the missing messages
      this.seq = message.seq;
    }
    switch (message.type) {
      case "replaced":
      case "delta":
      case "steered":
        return this.takeChange(message);
      case "clock":
        if ((message.wall ?? 0) < (this.clock.wall ?? 0)) return; // a message to all clients may be older
        this.clock = message;
        return this.tell("clock", message);
      case "pong":
        return this.serverClock.heard(message.sent, message.came, message.left, this.wall());
      case "done":
        this.moveTo(message.status?.clock);
        break;
      case "told":
        return this.takeTold(message);
      case "asked":
        if (this.questions.has(message.number)) return;
        this.questions.set(message.number, message);
        return this.tell("asked", message);
      case "withdrawn":
        this.questions.delete(message.number);
    }
    if (message.id !== undefined) this.end(message.id, message);
    this.tell(message.type, message);
  }

  private begin(welcome: Welcome): void {
    const before = this.welcome;
    this.welcome = welcome;
    this.welcomed = true;
    this.attempts = 0;
    this.why = "";
    this.clock = welcome.clock;
    this.serverClock.guess(this.wall(), welcome.clock?.wall ?? 0);
    if (!welcome.resumed) {
      this.seq = welcome.seq ?? 0;
      for (const number of [...this.questions.keys()]) {
        this.questions.delete(number);
        this.tell("withdrawn", { type: "withdrawn", number });
      }
      this.parts = [];
    }
    if (before && before.life !== welcome.life) this.change = null;
    this.become("open");
    for (const { id, outcome } of welcome.fates ?? []) {
      const why = { unseen: UNSEEN, forgotten: UNKNOWN }[outcome as string];
      if (why) this.end(id, { type: "done", id, ok: false, refusal: why });
    }
    this.tell("welcome", welcome);
    for (const { request } of [...this.waiting.values()]) if (!COMMANDS.has(request.type) && request.type !== "subscribe") this.send(request);
    this.subscribeAgain();
    if (!this.options.connect) this.pulse(...FIRST_PINGS);
  }

  private subscribeAgain(): void {
    if (!this.followed) return;
    const id = this.followed.id ?? ++this.ids;
    this.followed = { ...this.followed, id };
    const request = { type: "subscribe", ...this.followed, ...(this.change !== null ? { after: this.change } : {}) };
    if (!this.waiting.has(id)) this.waiting.set(id, { request, done: () => {} });
    this.send(request);
  }

  private takeChange(message: Message): void {
    const number = message.number ?? 0;
    if (message.type === "replaced") {
      this.change = number;
      this.timeline.replace(message.snapshot, number);
      return this.tell("change", message);
    }
    if (this.change === null || number <= this.change) return;
    this.moveTo(message.applied);
    if (message.type === "delta" && this.timeline.apply(message.delta, number)) {
      this.change = number;
      return this.tell("change", message);
    }
    this.change = null; // until a snapshot comes
    this.send({ type: "resync", full: true });
  }

  /** Sets a clock in virtual time, which only commands move. */
  private moveTo(now: number | undefined): void {
    if (this.clock.realtime || now === undefined) return;
    this.clock = { ...this.clock, now };
    this.tell("clock", this.clock);
  }

  /** Joins the parts of a long reply: appends each list to the list of the same name. */
  private takeTold(message: Message): void {
    this.parts.push(message);
    if (message.goes_on) return;
    const parts = this.parts;
    this.parts = [];
    if (parts.length > 1) {
      message = { ...message, reply: { ...message.reply } };
      for (const [name, own] of Object.entries(message.reply)) {
        if (Array.isArray(own)) message.reply[name] = parts.flatMap((part) => part.reply?.[name] ?? []);
      }
      if (parts.some((part) => part.lines)) message.lines = parts.flatMap((part) => part.lines ?? []);
    }
    this.tell("told", message);
  }

  private end(id: number, message: Message): void {
    const waits = this.waiting.get(id);
    this.waiting.delete(id);
    waits?.done(message);
  }
}

function refusal(detail: string, hint: string): Message {
  return { code: "offline", title: "Request refused", message: detail, detail, hint };
}

// --- clocks -----------------------------------------------------------------------------------------------------------

const WINDOW = 60; // [s] for which exchanges count: good clocks drift apart by a few ms in this time
const MAX_DRIFT = 500e-6; // maximum drift of a good clock
const FINEST = 1e-4; // [s] resolution of the clocks of browsers

/** A ping and its answer: in the middle, `at` by the clock here, the clock there was `offset` ahead, if both ways took
 * as long. `trip`: how long both took; `forward`: the clock there on arrival minus the one here on departure. [s] */
interface Exchange {
  at: number;
  forward: number;
  offset: number;
  trip: number;
}

/** Estimates the clock of the server from pings, as NTP does: the exchange with the shortest trip is nearest to the
 * truth. */
export class ServerClock {
  private exchanges: Exchange[] = [];
  private best: Exchange = { at: 0, forward: 0, offset: 0, trip: Infinity };

  /** Makes a first guess: the server's clock showed `there` when it made a message that arrived at `here`. */
  guess(here: number, there: number): void {
    if (!this.exchanges.length) this.best = { at: here, forward: there - here, offset: there - here, trip: Infinity };
  }

  /** Adds an exchange: sent at t0, at the server from t1 to t2, back at t3. */
  heard(t0: number, t1: number, t2: number, t3: number): void {
    const now = { at: (t0 + t3) / 2, forward: t1 - t0, offset: (t1 - t0 + (t2 - t3)) / 2, trip: t3 - t0 - (t2 - t1) };
    const mayBe = (this.best.trip + now.trip) / 2 + MAX_DRIFT * Math.abs(now.at - this.best.at) + FINEST;
    if (Math.abs(now.offset - this.best.offset) > mayBe) this.exchanges = []; // a clock was set, or this machine slept
    this.exchanges = [...this.exchanges.filter(({ at }) => at >= now.at - WINDOW), now];
    this.best = this.exchanges.reduce((best, one) => (best.trip <= one.trip ? best : one));
  }

  /** The shortest recent round trip [s]; infinite before the first. */
  get trip(): number {
    return this.best.trip;
  }

  /** D_f, the longest way to the server that was seen lately [s]; 0 before the first. It is wrong by half of what the two
   * ways differ in at least. */
  get forward(): number {
    return Math.max(...this.exchanges.map(({ forward }) => forward), this.best.forward) - this.best.offset;
  }

  /** Returns the time of the server's clock at a time of the clock here. */
  there(here: number): number {
    return here + this.best.offset;
  }
}

/** Returns the robot's clock `now` when the server's clock shows `wall`. */
export function robotClock(clock: Message, wall: number): number {
  const passes = clock.realtime && !clock.paused;
  return passes ? clock.now + (clock.rate ?? 1) * (wall - (clock.wall ?? 0)) : clock.now;
}
