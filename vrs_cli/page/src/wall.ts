import * as THREE from "three";
import "./style/style.css";
import "./style/class.css";
import { ago, handedInAt, wrong, type ClassState, type Student } from "./class";
import { Connection, type Message } from "./core/connection";
import { frames, g, type Model } from "./core/kinematics";
import { addressOf, bearer, exchangeToken, takeToken, viewOf } from "./core/token";
import { identity } from "./core/transform";
import { button, h } from "./dom";
import { Measured } from "./core/measured";
import { bytesOf, download } from "./panels/files";
import { HOME, homeBall, makeCamera, placeCamera } from "./scene/camera";
import { palette } from "./scene/colours";
import { Bodies, Figure } from "./scene/figure";
import { COINCIDE } from "./scene/ghosts";
import { isDark, onTheme } from "./style/theme";

THREE.Object3D.DEFAULT_UP.set(0, 0, 1);

const HZ = 2; // pictures of each robot per second

/** One robot of the wall: its picture and its texts. */
class Tile {
  connection: Connection | null = null;
  measured: Measured | null = null;
  student: Student | null = null;
  readonly canvas = h("canvas");
  private readonly picture = h("a", { class: "tile-picture", target: "_blank", rel: "noopener", tabindex: "-1", "aria-hidden": "true" }, this.canvas);
  readonly element: HTMLElement;
  private readonly link = h("a", { target: "_blank", rel: "noopener" });
  private readonly lamp = h("span", { class: "lamp", role: "img" });
  private readonly says = h("p", { class: "note" });
  private readonly since = h("span");
  private readonly help = h("div", { class: "row spread note warn", hidden: true }, this.since);
  private activity: Message = {};
  private robot = "";

  constructor(readonly name: string, private readonly token: string, answered: (student: string) => void) {
    this.help.append(button("Answered", () => answered(name)));
    this.link.textContent = name;
    this.element = h("article", { class: "tile", "aria-label": name }, this.picture,
      h("div", { class: "tile-text stack" }, h("div", { class: "row spread tile-name" }, this.link, this.lamp), this.says, this.help));
    this.show();
  }

  /** Follows a robot: the student's current or last one. */
  follow(robot: string): void {
    if (this.robot === robot) return;
    this.robot = robot;
    this.connection?.leave();
    this.connection = new Connection(addressOf(robot), this.token, "wall");
    this.connection.on("activity", (activity) => (this.activity = activity));
    this.measured = new Measured(this.connection);
    this.connection.on(["activity", "state", "alarm", "bodystatus", "told"], () => this.show());
    this.picture.href = this.link.href = viewOf(robot);
  }

  show(): void {
    const { student, activity, measured } = this;
    const alarm = measured?.alarms.at(-1);
    const open = this.connection?.state === "open";
    const lit = student ? !!student.here : open;
    this.element.classList.toggle("away", !lit);
    this.lamp.className = `lamp ${lit ? "good" : ""}`;
    this.lamp.ariaLabel = this.lamp.title = `${lit ? "" : "not "}${student ? "here" : "connected"}`;
    const at = handedInAt(student?.handed_in?.at(-1) ?? "");
    this.says.textContent = [
      lit ? "" : "is not here",
      student?.lesson ? `${student.lesson}${student.of ? `, step ${Math.min((student.step ?? 0) + 1, student.of)} of ${student.of}` : ""}` : "",
      activity.programs?.length ? `runs ${activity.programs.join(", ")}` : "",
      activity.driver && activity.driver !== this.name ? `${activity.driver} drives` : "",
      measured?.body?.name ? alarm ? `${measured.body.name}: alarm at ${alarm.t.toFixed(1)} s, likely cause: ${alarm.cause}` : `${measured.body.name} is the body` : "",
      at ? `handed in ${at.toLocaleTimeString([], { timeStyle: "short" })}` : "",
    ].filter(Boolean).join(" · ");
    const asks = student?.help != null;
    this.element.classList.toggle("asks", asks);
    this.help.hidden = !asks;
    if (asks) this.since.textContent = `Asks for help: ${ago(student!.help!)}`;
  }
}

/** Figures that all robots of one kind share, for the arm and for a measured one, and the place of their camera. */
interface Kind {
  figure: Figure;
  measured: Figure;
  ball: THREE.Sphere;
}

/** Small pictures of many robots, drawn by one renderer and copied to a canvas each. Resting robots are not redrawn. */
class Tiles {
  /** Number of drawn pictures, for tests. */
  drawn = 0;
  private readonly drawing = new OffscreenCanvas(1, 1);
  private readonly renderer = new THREE.WebGLRenderer({ canvas: this.drawing, antialias: false, powerPreference: "low-power" });
  private readonly scene = new THREE.Scene();
  private readonly camera = makeCamera();
  private readonly lamp = new THREE.DirectionalLight(0xffffff, 2.2);
  private readonly sky = new THREE.HemisphereLight(0xffffff, 0xffffff, 1.8);
  private readonly kinds = new Map<string, Kind>();
  private readonly known = new WeakMap<Model, Kind>();
  private readonly places = new Map<HTMLCanvasElement, { robot: () => Connection | null; measured: () => number[] | null; seen: string }>();
  private readonly clear = new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.5, depthWrite: false });

  /** `hz`: pictures of each robot per second. */
  constructor(hz: number) {
    this.lamp.position.set(1.5, -1, 3);
    this.scene.add(this.sky, this.lamp);
    onTheme(() => this.paint());
    this.paint();
    setInterval(() => document.hidden || this.places.forEach((_, canvas) => this.draw(canvas)), 1000 / hz);
  }

  /** Adds a canvas for a robot, with a translucent arm at the last measured position if it differs. */
  add(canvas: HTMLCanvasElement, robot: () => Connection | null, measured: () => number[] | null): void {
    this.places.set(canvas, { robot, measured, seen: "" });
  }
  remove(canvas: HTMLCanvasElement): void {
    this.places.delete(canvas);
  }

  private paint(): void {
    const { background, sky, ground, measured } = palette(isDark());
    this.clear.color.set(measured);
    this.renderer.setClearColor(background);
    this.sky.color.set(sky);
    this.sky.groundColor.set(ground);
    this.redraw();
  }

  private redraw(): void {
    for (const place of this.places.values()) place.seen = "";
  }

  private kind(model: Model): Kind {
    const known = this.known.get(model);
    if (known) return known;
    const key = JSON.stringify([model.name, model.joints, model.base ?? 0, model.flange ?? 0, model.shapes]);
    let kind = this.kinds.get(key);
    if (!kind) {
      const bodies = new Bodies(model);
      kind = { figure: new Figure(bodies), measured: new Figure(bodies, { material: this.clear, order: 1 }), ball: homeBall(bodies) };
      this.scene.add(kind.figure.root, kind.measured.root);
      this.kinds.set(key, kind);
      void bodies.ready.then(() => {
        kind!.ball = homeBall(bodies);
        this.redraw();
      });
    }
    this.known.set(model, kind);
    return kind;
  }

  /** Draws a visible robot if it has moved. */
  private draw(canvas: HTMLCanvasElement): void {
    const { top, bottom, width, height } = canvas.getBoundingClientRect();
    const place = this.places.get(canvas)!;
    const robot = place.robot();
    const model = robot?.welcome?.model;
    if (!model || !width || bottom < 0 || top > innerHeight || !robot.timeline.segments.length) return;
    const t = Math.min(robot.now(), robot.timeline.end);
    const [wide, high] = [width, height].map((x) => Math.round(x));
    const [planned, q] = [g(model, robot.timeline, t), place.measured()];
    const away = q && Math.max(...q.map((x, i) => Math.abs(x - planned[i]))) > COINCIDE ? q : null;
    const now = `${robot.url} ${robot.timeline.version} ${t} ${wide} ${high} ${away?.map((x) => x.toFixed(3))}`;
    if (now === place.seen) return;
    place.seen = now;
    const shown = this.kind(model);
    for (const kind of this.kinds.values()) {
      kind.figure.root.visible = kind === shown;
      kind.measured.root.visible = kind === shown && !!away;
    }
    shown.figure.pose(frames(model, planned), 0, identity());
    if (away) shown.measured.pose(frames(model, away), 0, identity());
    this.camera.aspect = wide / high;
    placeCamera(this.camera, shown.ball, HOME);
    this.camera.lookAt(shown.ball.center);
    this.camera.updateProjectionMatrix();
    if (this.drawing.width !== wide || this.drawing.height !== high) this.renderer.setSize(wide, high, false);
    this.renderer.render(this.scene, this.camera);
    canvas.getContext("bitmaprenderer")!.transferFromImageBitmap(this.drawing.transferToImageBitmap());
    this.drawn++;
  }
}

/** The wall: all robots of a token, and of a class all students. */
class Wall {
  private readonly tiles = new Map<string, Tile>();
  private readonly grid = h("div", { class: "wall-tiles" });
  private readonly count = h("span", { class: "note", role: "status" });
  private readonly note = h("p", { class: "note bad wall-note", role: "alert", hidden: true });
  private readonly freeze = button("Freeze", () => this.ask("freeze", { frozen: this.freeze.ariaPressed !== "true" }), {
    "aria-pressed": "false", title: "Nobody's commands are carried out until you go on; ABORT is",
  });
  private readonly teaching: HTMLElement;
  readonly pictures = new Tiles(HZ);
  private class: Connection | null = null;

  constructor(private readonly token: string) {
    const text = h("input", { class: "field", placeholder: "Say something to all", "aria-label": "Message to all students", maxlength: "4000" });
    const say = h("form", { class: "wall-say", onsubmit: (event: Event) => {
      event.preventDefault();
      if (text.value.trim()) void this.ask("announce", { text: text.value }).then((done) => done && (text.value = ""));
    } }, text, h("button", { class: "button", text: "Say to all" }));
    const collect = button("Collect", async () => {
      const answer = await this.ask("collect", {});
      if (answer) download(String(answer.name), bytesOf(answer.data));
    }, { title: "Save the newest program of each as a ZIP file" });
    this.teaching = h("div", { class: "row wall-teaching", hidden: true }, say, this.freeze, collect);
    document.body.append(h("main", { class: "wall" },
      h("header", { class: "wall-head" }, h("h1", { text: "All robots" }), this.count, this.teaching), this.note,
      h("div", { class: "wall-scroll" }, this.grid)));
    setInterval(() => this.tiles.forEach((tile) => tile.show()), 20_000); // to update the ages
  }

  /** Shows the robots that the token allows, or the students of a teacher's class. */
  async open(): Promise<void> {
    const answer = await fetch("/robots", { headers: bearer(this.token), cache: "no-store" }).catch(() => null);
    if (!answer?.ok) return this.tell(answer ? (await answer.text()).trim() : "The server does not answer. Load this page again.");
    const { robots } = (await answer.json()) as { robots: string[] };
    if (!robots.length) return this.tell("There is no robot for you here.");
    await exchangeToken(robots[0], this.token);
    const first = (this.class = new Connection(addressOf(robots[0]), this.token, "wall"));
    first.on("classstate", (state: ClassState) => this.state(state));
    first.on("welcome", (welcome) => {
      const all = (): void => robots.forEach((robot) => this.tile(robot).follow(robot));
      if (welcome.role !== "teacher") return all();
      void first.ask("watchclass").then((done) => (wrong(done) ? all() : undefined));
    });
  }

  private tile(name: string): Tile {
    const known = this.tiles.get(name);
    if (known) return known;
    const tile = new Tile(name, this.token, (student) => void this.ask("askhelp", { wanted: false, student }));
    this.tiles.set(name, tile);
    this.grid.append(tile.element);
    this.pictures.add(tile.canvas, () => tile.connection, () => tile.measured?.last?.q ?? null);
    return tile;
  }

  /** Shows the state of a class: students who wait for help first, the longest waiting at the top, then all by name. */
  private state({ frozen, students = [] }: ClassState): void {
    this.teaching.hidden = false;
    this.freeze.ariaPressed = String(!!frozen);
    this.freeze.textContent = frozen ? "Go on" : "Freeze";
    const waits = (one: Student): number => one.help ?? Infinity;
    const ordered = [...students].sort((a, b) => waits(a) - waits(b) || a.name.localeCompare(b.name));
    ordered.forEach((student, place) => {
      const tile = this.tile(student.name);
      tile.student = student;
      if (student.at) tile.follow(student.at);
      tile.show();
      tile.element.style.order = String(place);
    });
    for (const [name, tile] of this.tiles) {
      if (students.some((one) => one.name === name)) continue;
      tile.connection?.leave();
      tile.element.remove();
      this.tiles.delete(name);
      this.pictures.remove(tile.canvas);
    }
    const [here, ask] = [students.filter((one) => one.here).length, students.filter((one) => one.help != null).length];
    this.count.textContent = `${here} of ${students.length} are here${ask ? `, ${ask} ask${ask === 1 ? "s" : ""} for help` : ""}`;
    document.title = ask ? `(${ask}) all robots` : "vrs: all robots";
  }

  private async ask(type: string, fields: Message): Promise<Message | null> {
    const answer = await this.class!.ask(type, fields);
    this.tell(wrong(answer) ?? "");
    return wrong(answer) ? null : answer;
  }

  private tell(text: string): void {
    this.note.textContent = text;
    this.note.hidden = !text;
  }
}

const wall = new Wall(takeToken());
void wall.open();
Object.assign(window, { wall });
