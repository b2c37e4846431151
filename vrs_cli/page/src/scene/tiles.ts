import * as THREE from "three";
import type { Connection } from "../core/connection";
import { frames, g, type Model } from "../core/kinematics";
import { identity } from "../core/transform";
import { HOME, homeBall, makeCamera, placeCamera } from "./camera";
import { isDark, onTheme } from "../style/theme";
import { palette } from "./colours";
import { Bodies, Figure } from "./figure";
import { COINCIDE } from "./ghosts";

THREE.Object3D.DEFAULT_UP.set(0, 0, 1);

/** Figures that all robots of one kind share, of the arm and of a measured one, and where the camera stands for them. */
interface Kind {
  figure: Figure;
  measured: Figure;
  ball: THREE.Sphere;
}

/** Small pictures of many robots, drawn by one renderer on one canvas behind them. What stands still is not drawn again. */
export class Tiles {
  readonly drawn = { tiles: 0, milliseconds: 0 };
  private readonly renderer = new THREE.WebGLRenderer({ antialias: false, alpha: true, preserveDrawingBuffer: true, powerPreference: "low-power" });
  private readonly scene = new THREE.Scene();
  private readonly camera = makeCamera();
  private readonly lamp = new THREE.DirectionalLight(0xffffff, 2.2);
  private readonly sky = new THREE.HemisphereLight(0xffffff, 0xffffff, 1.8);
  private readonly kinds = new Map<string, Kind>();
  private readonly known = new WeakMap<Model, Kind>();
  private readonly places = new Map<HTMLElement, { robot: () => Connection | null; measured: () => number[] | null; seen: string }>();
  private readonly clear = new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.5, depthWrite: false });
  private background = new THREE.Color();
  private layout = "";

  /** `grid` holds the places of the pictures; `hz`: how often they are looked at. */
  constructor(private readonly grid: HTMLElement, hz: number) {
    this.renderer.setPixelRatio(1);
    this.renderer.setScissorTest(true);
    this.renderer.domElement.setAttribute("aria-hidden", "true");
    this.lamp.position.set(1.5, -1, 3);
    this.scene.add(this.sky, this.lamp);
    grid.prepend(this.renderer.domElement);
    onTheme(() => this.paint());
    this.paint();
    setInterval(() => document.hidden || this.draw(), 1000 / hz);
  }

  /** Draws a robot where an element is, and seen through where it was measured last, if that is elsewhere. */
  add(place: HTMLElement, robot: () => Connection | null, measured: () => number[] | null): void {
    this.places.set(place, { robot, measured, seen: "" });
  }
  remove(place: HTMLElement): void {
    this.places.delete(place);
    this.layout = "";
  }

  private paint(): void {
    const { background, sky, ground, measured } = palette(isDark());
    this.clear.color.set(measured);
    this.background = new THREE.Color(background);
    this.sky.color.set(sky);
    this.sky.groundColor.set(ground);
    this.layout = "";
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
        this.layout = "";
      });
    }
    this.known.set(model, kind);
    return kind;
  }

  private draw(): void {
    const begun = performance.now();
    const whole = this.grid.getBoundingClientRect();
    const seen = this.grid.parentElement!.getBoundingClientRect();
    const places = [...this.places].map(([element, place]) => ({ place, rect: element.getBoundingClientRect() }));
    const layout = [whole.width, whole.height, ...places.map(({ rect }) => `${rect.x - whole.x} ${rect.y - whole.y}`)].join();
    if (layout !== this.layout) {
      this.layout = layout;
      this.renderer.setSize(whole.width, whole.height);
      this.renderer.setScissor(0, 0, whole.width, whole.height);
      this.renderer.setClearColor(this.background, 0);
      this.renderer.clear();
      for (const { place } of places) place.seen = "";
    }
    for (const { place, rect } of places) {
      if (rect.bottom < seen.top || rect.top > seen.bottom) continue;
      const robot = place.robot();
      const model = robot?.welcome?.model;
      if (!robot || !model || !robot.timeline.segments.length) continue;
      const t = Math.min(robot.now(), robot.timeline.end);
      const [planned, q] = [g(model, robot.timeline, t), place.measured()];
      const away = q && Math.max(...q.map((x, i) => Math.abs(x - planned[i]))) > COINCIDE ? q : null;
      const now = `${robot.url} ${robot.timeline.version} ${t} ${away?.map((x) => x.toFixed(3))}`;
      if (now === place.seen) continue;
      place.seen = now;
      this.drawOne(model, frames(model, planned), away && frames(model, away), rect, whole);
      this.drawn.tiles++;
    }
    this.drawn.milliseconds += performance.now() - begun;
  }

  private drawOne(model: Model, links: Float64Array[], away: Float64Array[] | null, rect: DOMRect, whole: DOMRect): void {
    const shown = this.kind(model);
    for (const kind of this.kinds.values()) {
      kind.figure.root.visible = kind === shown;
      kind.measured.root.visible = kind === shown && !!away;
    }
    shown.figure.pose(links, 0, identity());
    if (away) shown.measured.pose(away, 0, identity());
    this.camera.aspect = rect.width / rect.height;
    placeCamera(this.camera, shown.ball, HOME);
    this.camera.lookAt(shown.ball.center);
    this.camera.updateProjectionMatrix();
    const [x, y] = [rect.x - whole.x, whole.bottom - rect.bottom];
    this.renderer.setViewport(x, y, rect.width, rect.height);
    this.renderer.setScissor(x, y, rect.width, rect.height);
    this.renderer.setClearColor(this.background, 1);
    this.renderer.render(this.scene, this.camera);
  }
}
