import { Model } from "./kinematics";
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

/** The names of what can be listened to: messages by their type, and "state" of the connection, "change" of the timeline. */
export type Topic =
  | "state" | "welcome" | "change" | "clock" | "told" | "typed" | "asked" | "withdrawn"
  | "activity" | "lease" | "status" | "pulled" | "preview" | "closing"
  | "classstate" | "announced" | "lesson";
export type ConnectionState = "opening" | "open" | "cut" | "refused";

/** A client of one robot, by docs/protocol.md: it holds the timeline and the clock. */
export class Connection {
  readonly timeline = new Timeline();
  welcome: Welcome | null = null;
  state: ConnectionState = "opening";
  private clock = { now: 0, rate: 0, paused: false, realtime: false, at: 0 };
  private listeners = new Map<string, Set<(message: Message) => void>>();
  private waiting = new Map<number, { done: (answer: Message) => void; told: (message: Message) => void }>();
  private ids = 0;
  private left = false;
  private seq = 0;
  private bestTrip = Infinity;
  private socket!: WebSocket;

  constructor(readonly url: string, private readonly token: string, private readonly name: string) {
    this.open();
  }

  /** Calls `heard` with each message of a topic; returns what ends that. */
  on(topic: Topic, heard: (message: Message) => void): () => void {
    const set = this.listeners.get(topic) ?? new Set();
    this.listeners.set(topic, set.add(heard));
    return () => set.delete(heard);
  }

  /** Sends a message; false where there is no connection. */
  send(message: Message): boolean {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** Sends a command or a request; its answer is what ends it (done, refused, located, ...). `told` hears what is said of it. */
  ask(type: string, fields: Message = {}, told: (message: Message) => void = () => {}): Promise<Message> {
    const id = ++this.ids;
    return new Promise((done) => {
      this.waiting.set(id, { done, told });
      if (!this.send({ type, id, ...fields })) this.end({ type: "refused", id, refusal: { code: "offline", message: "there is no connection: this was not sent", hint: "give it again when it is back" } });
    });
  }

  /** The robot's clock, now [s]. */
  now(): number {
    const { now, rate, paused, realtime, at } = this.clock;
    return realtime && !paused ? now + rate * (performance.now() / 1000 - at) : now;
  }
  /** Whether the robot's clock goes on by itself. */
  get passes(): boolean {
    return this.clock.realtime && !this.clock.paused;
  }

  /** Leaves for good: the server forgets this client at once. */
  leave(): void {
    this.left = true;
    this.send({ type: "bye" });
    this.socket.close();
  }

  private open(): void {
    const socket = (this.socket = new WebSocket(this.url));
    const resume = this.welcome && { connection: this.welcome.connection, seq: this.seq, unanswered: [...this.waiting.keys()] };
    socket.onopen = () =>
      socket.send(
        JSON.stringify({
          type: "hello", versions: [1], name: this.name, full: true, attended: true, rendered: 100,
          ...(this.token ? { token: this.token } : {}), ...(resume ? { resume } : {}),
        }),
      );
    socket.onmessage = (event) => this.take(JSON.parse(event.data as string));
    socket.onclose = () => {
      this.become("cut");
      if (!this.left) setTimeout(() => this.open(), 1000);
    };
  }

  private become(state: ConnectionState): void {
    this.state = state;
    this.tell("state", { state });
  }

  private tell(topic: string, message: Message): void {
    for (const heard of this.listeners.get(topic) ?? []) heard(message);
  }

  private end(message: Message): void {
    this.waiting.get(message.id)?.done(message);
    this.waiting.delete(message.id);
  }

  private take(message: Message): void {
    if (message.seq) this.seq = message.seq;
    switch (message.type) {
      case "welcome": {
        const again = this.welcome?.life === message.life;
        this.welcome = message as Welcome;
        this.setClock(message.clock);
        this.become("open");
        this.tell("welcome", message);
        void this.ask("subscribe", { deltas: true, window: 60, ...(again ? { after: this.timeline.number } : {}) });
        this.ping();
        return;
      }
      case "replaced":
        this.timeline.replace(message.snapshot, message.number ?? 0);
        return this.tell("change", message);
      case "delta":
        if (!this.timeline.apply(message.delta, message.number ?? 0)) this.send({ type: "resync" });
        return this.tell("change", message);
      case "clock":
        this.setClock(message);
        return this.tell("clock", message);
      case "pong": {
        const trip = performance.now() / 1000 - message.sent;
        if (trip < this.bestTrip + 0.0005) {
          this.bestTrip = Math.min(this.bestTrip, trip);
          this.setClock({ ...this.clock, now: message.clock }, trip / 2);
        }
        return;
      }
      case "told":
      case "asked":
        if (message.id !== undefined) this.waiting.get(message.id)?.told(message);
        return this.tell(message.type, message);
      default:
        if (message.id !== undefined && message.type !== "withdrawn") this.end(message);
        return this.tell(message.type, message);
    }
  }

  private ping(): void {
    if (this.send({ type: "ping", sent: performance.now() / 1000 })) setTimeout(() => this.ping(), 2000);
  }

  private setClock(clock: Message, since = 0): void {
    this.clock = {
      now: clock.now, rate: clock.rate ?? 1, paused: !!clock.paused, realtime: !!clock.realtime,
      at: performance.now() / 1000 - since,
    };
  }
}
