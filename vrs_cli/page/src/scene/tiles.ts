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

/** Small pictures of many robots, drawn by one renderer and copied to a canvas for each. What stands still is not drawn again. */
export class Tiles {
  /** Pictures drawn so far: for tests. */
  drawn = 0;
  private readonly renderer = new THREE.WebGLRenderer({ antialias: false, powerPreference: "low-power" });
  private readonly scene = new THREE.Scene();
  private readonly camera = makeCamera();
  private readonly lamp = new THREE.DirectionalLight(0xffffff, 2.2);
  private readonly sky = new THREE.HemisphereLight(0xffffff, 0xffffff, 1.8);
  private readonly kinds = new Map<string, Kind>();
  private readonly known = new WeakMap<Model, Kind>();
  private readonly places = new Map<HTMLCanvasElement, { robot: () => Connection | null; measured: () => number[] | null; seen: string }>();
  private readonly clear = new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.5, depthWrite: false });

  /** `hz`: how often the robots are looked at. */
  constructor(hz: number) {
    this.lamp.position.set(1.5, -1, 3);
    this.scene.add(this.sky, this.lamp);
    onTheme(() => this.paint());
    this.paint();
    setInterval(() => document.hidden || this.places.forEach((_, canvas) => this.draw(canvas)), 1000 / hz);
  }

  /** Draws a robot on a canvas from now on, and seen through where it was measured last, if that is elsewhere. */
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

  /** Draws a robot that is in the window, if it has moved. */
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
    const drawn = this.renderer.domElement;
    if (drawn.width !== wide || drawn.height !== high) this.renderer.setSize(wide, high);
    this.renderer.render(this.scene, this.camera);
    Object.assign(canvas, { width: wide, height: high });
    canvas.getContext("2d")!.drawImage(drawn, 0, 0);
    this.drawn++;
  }
}
