import "./scene.css";
import * as THREE from "three";
import type { App, Shown } from "../app";
import { frames } from "../core/kinematics";
import { fixed } from "../core/pose";
import { identity, inverse, multiply, transformOf, type Transform } from "../core/transform";
import { axes } from "./axes";
import { DIRECTIONS, HOME, homeBall } from "./camera";
import { GREY } from "./colours";
import { Bodies, Figure, matrixOf, reachOf, roomOf, setPose } from "./figure";
import { BranchView, GoalView, PredictionView } from "./ghosts";
import { Gizmo } from "./gizmo";
import { Labels } from "./labels";
import { PartsView, type CellScene } from "./parts";
import { PathView } from "./path";
import { PlacesView, ReasonView, type Sketch } from "./places";
import { RangesView, ReachView } from "./reach";
import { Stage } from "./stage";

/** Something in the picture that the menu Show switches on and off. */
export interface Layer {
  readonly name: string;
  readonly label: string;
  /** One sentence that says what it is. */
  readonly hint: string;
  readonly on: boolean;
  set(on: boolean): void;
}

/** What a button at the canvas does with the camera. `on`: of "follow", which stays pressed. */
export interface CameraAction {
  readonly name: "home" | "fit" | "front" | "side" | "top" | "follow";
  readonly label: string;
  readonly hint: string;
  readonly on?: boolean;
  run(): void;
}

/** The picture of the robot, for the other panels of the page. */
export interface Scene {
  readonly stage: Stage;
  readonly layers: Layer[];
  readonly cameras: CameraAction[];
  readonly gizmo: Gizmo;
  readonly labels: Labels;
  readonly figure: Figure;
  /** Resolved when all meshes are there. */
  readonly ready: Promise<void>;
  /** Draws what WHY or EXPLAIN says until the timeline changes; null takes it away. */
  explain(sketch: Sketch | null): void;
}

/** The moment that is shown, in the world: T_robot_world is the BASE of the motion under way. */
export interface InWorld extends Shown {
  T_world_robot: Transform;
  T_world_tool: Transform;
  /** How far the hand is open: 1 open, 0 closed. */
  hand: number;
}

/** Makes the picture of the robot. */
export function makeScene(app: App, slot: HTMLElement): Scene {
  const { model } = app.source;
  const bodies = new Bodies(model);
  const zero = frames(model, model.joints.map(() => 0));
  const reach = reachOf(model, zero);
  const foot = roomOf({ ...bodies, all: bodies.all.filter((body) => body.link === 0) } as Bodies, [zero]).min.z;
  const stage = new Stage(slot, reach, Number.isFinite(foot) ? foot : 0, () => app.wake());
  stage.view.setAttribute("aria-label", "the robot");
  const labels = new Labels(stage);
  const figure = new Figure(bodies);
  const triads = { world: axes(0.22 * reach), base: axes(0.22 * reach), tool: axes(0.22 * reach) };
  stage.scene.add(figure.root, ...Object.values(triads));

  const path = new PathView(stage, labels, model);
  const places = new PlacesView(stage, labels, model);
  const reasons = new ReasonView(stage, labels);
  stage.scene.add(path.root, places.root, reasons.root);
  const goal = new GoalView(stage, bodies, model);
  const prediction = new PredictionView(stage, bodies, model);
  const ranges = new RangesView(stage, labels, model, bodies, figure);
  const gizmo = new Gizmo(stage, labels);
  const { connection } = app;
  const branches = connection && new BranchView(stage, labels, bodies, model, connection);
  const boundary = connection && model.joints[0].kind !== "prismatic" ? new ReachView(stage, figure, connection) : null;

  const scenery = app.source.cell?.scene as CellScene | undefined;
  const parts = scenery && new PartsView(stage, labels, figure, app.source.world, scenery);
  if (parts) stage.scene.add(parts.root);

  // --- what can be switched ---
  const layers: Layer[] = [];
  const layer = (name: string, label: string, hint: string, on: boolean, set: (on: boolean) => void): void => {
    layers.push({
      name, label, hint, on,
      set(to: boolean) {
        Object.assign(this, { on: to });
        set(to);
        at = "";
        stage.change();
      },
    });
  };
  layer("path", "Path", "The way of the tool: past blue, planned orange, lighter where motions blend", true, (on) => (path.visible = on));
  layer("commands", "Commands", "The text of each command where its motion begins", false, (on) => (path.commands = on));
  layer("goal", "Goal", "The outline of the arm as it will stand when the motion ends", true, (on) => (goal.visible = on));
  if (branches) layer("branches", "Branches", "The arm as other branches move it", true, (on) => (branches.visible = on));
  layer("places", "Places", "The locations that have names", true, (on) => (places.visible = on));
  if (parts) {
    layer("parts", "Cell", "Parts, fixtures and sensors; what touches is red", true, (on) => (parts.visible = on));
    layer("part names", "Names of parts", "The name of each part beside it", true, (on) => {
      parts.named = on;
      if (!on) labels.remove("part ");
    });
  }
  layer("ranges", "Joint ranges", "How far each joint goes, and where it is", false, (on) => (ranges.visible = on));
  if (boundary) layer("reach", "Reach", "How far the tool gets in this configuration", false, (on) => (boundary.visible = on));
  let framed = true;
  layer("frames", "Frames", "The axes of world, base and tool", true, (on) => {
    framed = on;
    for (const triad of Object.values(triads)) triad.visible = on;
    if (!on) labels.remove("frame ");
  });

  // --- the camera ---
  let base = identity(); // T_world_robot
  let touched = false; // the user has moved the camera
  let follows = false;
  let tip: THREE.Vector3 | null = null;
  const inWorld = (ball: THREE.Sphere): THREE.Sphere => {
    ball.center.applyMatrix4(matrixOf(base));
    return ball;
  };
  const home = (towards = HOME): void => stage.look(inWorld(homeBall(model, bodies)), towards);
  const fit = (): void => {
    const room = new THREE.Box3().setFromObject(figure.root, true);
    for (const mesh of [triads.world, triads.tool]) room.expandByPoint(new THREE.Vector3().setFromMatrixPosition(mesh.matrix));
    stage.look(room.getBoundingSphere(new THREE.Sphere()), stage.camera.position.clone().sub(stage.controls.target));
  };
  stage.controls.addEventListener("start", () => (touched = true));
  const action = (name: CameraAction["name"], label: string, hint: string, run: () => void): CameraAction => ({
    name, label, hint,
    run: () => {
      touched = name !== "home";
      run();
    },
  });
  const follow: CameraAction = {
    name: "follow", label: "Follow the tool", hint: "Keep the tool where it is in the picture", get on() { return follows; },
    run: () => {
      [follows, tip] = [!follows, null];
      stage.change();
    },
  };
  const cameras = [
    action("home", "Home", "Look at the robot as when the page began", home),
    action("fit", "Fit", "Have all of the robot in the picture", fit),
    action("front", "Front", "Look from the front, along -X", () => home(DIRECTIONS.front)),
    action("side", "Side", "Look from the robot's right, along Y", () => home(DIRECTIONS.side)),
    action("top", "Top", "Look from above", () => home(DIRECTIONS.top)),
    follow,
  ];
  home();
  void bodies.ready.then(() => (touched ? stage.change(true) : home()));
  new ResizeObserver(() => touched || home()).observe(stage.view);

  // --- each moment ---
  let at = ""; // what was drawn last
  let heard = true;
  const show = (shown: Shown): void => {
    const { t, timeline, tool } = shown;
    const rows = timeline.locate(t)[0].motion.frames?.base;
    const T_world_robot = rows ? inverse(transformOf(rows)) : identity();
    const here: InWorld = { ...shown, T_world_robot, T_world_tool: multiply(T_world_robot, tool), hand: parts ? app.source.world.fingers(t, timeline.handEvent(t)) : timeline.hand(t) };
    const listens = !app.connection || app.connection.state === "open";
    const now = `${shown.q} ${here.hand} ${T_world_robot} ${tool} ${listens}`;
    if (now !== at) {
      at = now;
      draw(here);
      if (listens !== heard) {
        heard = listens;
        for (let i = 0; i <= model.joints.length; i++) figure.paint(i, heard ? null : GREY);
      }
      stage.change(true);
    }
    triads.tool.visible = framed && !gizmo.seen;
    for (const part of [parts, path, places, reasons, goal, ranges, gizmo, branches, boundary]) part?.show(here);
    prediction.show(here, app.playback.following);
    if (!app.playback.moves) describe(here);
    stage.draw(app.playback.moves);
  };
  /** Says what the picture shows, for screen readers: the tool, what the hand holds, where parts stand, what touches. */
  const describe = ({ t, T_world_tool }: InWorld): void => {
    const [x, y, z] = [3, 7, 11].map((k) => fixed(1000 * T_world_tool[k], 0));
    const text = ["the robot", `its tool is at X ${x} Y ${y} Z ${z} mm`, ...(parts?.told(t) ?? [])].join("; ");
    if (stage.view.getAttribute("aria-label") !== text) stage.view.setAttribute("aria-label", text);
  };
  const draw = ({ frames, hand, T_world_robot, T_world_tool }: InWorld): void => {
    base = T_world_robot;
    figure.pose(frames, hand, T_world_robot);
    const height = scenery?.floor;
    setPose(stage.floor.root, height == null ? multiply(T_world_robot, stage.floor.T_robot_floor) : Float64Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, height));
    setPose(triads.base, T_world_robot);
    setPose(triads.tool, T_world_tool);
    const moved = T_world_robot.some((x, i) => x !== identity()[i]);
    if (framed) {
      triads.base.visible = moved;
      labels.set("frame world", "frame", "world", [0, 0, 0]);
      labels.set("frame tool", "frame", "tool", [T_world_tool[3], T_world_tool[7], T_world_tool[11]]);
      if (moved) labels.set("frame base", "frame", "base", [T_world_robot[3], T_world_robot[7], T_world_robot[11]]);
      else labels.remove("frame base");
    }
    const place = new THREE.Vector3(T_world_tool[3], T_world_tool[7], T_world_tool[11]);
    if (follows && tip) stage.pan(place.clone().sub(tip));
    tip = place;
  };
  stage.view.addEventListener("keydown", (event) => {
    if (gizmo.key(event)) {
      event.preventDefault();
      event.stopImmediatePropagation();
    }
  }, { capture: true });
  app.add({ show });
  return { stage, layers, cameras, gizmo, labels, figure, ready: bodies.ready, explain: (sketch) => reasons.explain(sketch) };
}
