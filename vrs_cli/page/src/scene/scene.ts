import "./scene.css";
import * as THREE from "three";
import type { App, Shown, Switch } from "../app";
import { Change } from "../core/change";
import { frames, slides } from "../core/kinematics";
import { fixed } from "../core/pose";
import { identity, movedTo, multiply, originOf, type Transform } from "../core/transform";
import type { Icon } from "../style/icons";
import { DIRECTIONS, HOME, homeBall } from "./camera";
import { Bodies, Figure, GREY, matrixOf, reachOf, roomOf, setPose } from "./figure";
import { BranchView, goalView, measuredView, predictionView } from "./ghosts";
import { Gizmo } from "./gizmo";
import { axes } from "./lines";
import { PartsView, type CellScene } from "./parts";
import { PathView } from "./path";
import { PlacesView, ReasonView, type Sketch } from "./places";
import { RangesView, ReachView } from "./reach";
import { Stage } from "./stage";

/** The action of a camera button. `on`: whether it is pressed. */
export interface CameraAction {
  readonly icon: Icon;
  readonly label: string;
  readonly hint: string;
  on?(): boolean;
  run(): void;
}

/** The picture of the robot, for the other panels of the page. `ready` resolves when all meshes are there; `explain` draws what
 * WHY or EXPLAIN says until the timeline changes, and null takes it away. */
export type Scene = ReturnType<typeof makeScene>;

/** The displayed state in the world frame: T_robot_world is the BASE of the current motion. */
export interface InWorld extends Shown {
  T_world_robot: Transform;
  T_world_tool: Transform;
  /** How far the hand is open: 1 open, 0 closed. */
  hand: number;
}

/** Makes the picture of the robot. */
export function makeScene(app: App, slot: HTMLElement) {
  const { connection, source } = app;
  const { model } = source;
  const bodies = new Bodies(model);
  const zero = frames(model, model.joints.map(() => 0));
  const reach = reachOf(model, zero);
  const foot = roomOf(bodies.all.filter((body) => body.link === 0), [zero]).min.z;
  const stage = new Stage(slot, reach, Number.isFinite(foot) ? foot : 0, () => app.wake());
  const { labels } = stage;
  const figure = new Figure(bodies);
  const triads = { world: axes(0.22 * reach), base: axes(0.22 * reach), tool: axes(0.22 * reach) };

  const path = new PathView(stage, model);
  const places = new PlacesView(stage, model);
  const reasons = new ReasonView(stage);
  stage.scene.add(figure.root, ...Object.values(triads), path.root, places.root, reasons.root);
  const goal = goalView(stage, bodies);
  const prediction = predictionView(stage, bodies, () => app.playback.following);
  const measured = source.measured && measuredView(stage, bodies);
  const ranges = new RangesView(stage, bodies, figure);
  const gizmo = new Gizmo(stage);
  const branches = connection && new BranchView(stage, bodies, connection);
  const boundary = connection && !slides(model.joints[0]) && new ReachView(stage, figure, connection);

  const scenery = source.cell?.scene as CellScene | undefined;
  const parts = scenery && new PartsView(stage, figure, source.world, scenery);
  if (parts) stage.scene.add(parts.root);

  // --- what can be switched ---
  const drawn = new Change();
  let framed = true;
  const layer = (name: string, label: string, hint: string, on: boolean, set: (on: boolean) => void): Switch => ({
    name, label, hint, on,
    set(to: boolean) {
      this.on = to;
      set(to);
      drawn.forget();
      stage.change();
    },
  });
  const layers = [
    layer("path", "Path", "The way of the tool: past blue, planned orange, lighter where motions blend", true, (on) => (path.visible = on)),
    layer("commands", "Commands", "The text of each command where its motion begins", false, (on) => (path.commands = on)),
    layer("goal", "Goal", "The outline of the arm as it will stand when the motion ends", true, (on) => (goal.visible = on)),
    measured && layer("measured", "Measured arm", "The arm as the robot's body has measured it, where it differs", true, (on) => (measured.visible = on)),
    branches && layer("branches", "Branches", "The arm as other branches move it", true, (on) => (branches.visible = on)),
    layer("places", "Places", "The locations that have names", true, (on) => (places.visible = on)),
    parts && layer("parts", "Cell", "Parts, fixtures and sensors; what touches is red", true, (on) => (parts.visible = on)),
    parts && layer("part names", "Names of parts", "The name of each part beside it", true, (on) => (parts.named = on)),
    layer("ranges", "Joint ranges", "How far each joint goes, and where it is", false, (on) => (ranges.visible = on)),
    boundary && layer("reach", "Reach", "How far the tool gets in this configuration", false, (on) => (boundary.visible = on)),
    layer("frames", "Frames", "The axes of world, base and tool", true, (on) => {
      framed = on;
      for (const triad of Object.values(triads)) triad.visible = on;
      if (!on) labels.remove("frame ");
    }),
  ].filter((one) => !!one);

  // --- the camera ---
  let base = identity(); // T_world_robot
  let touched = false; // whether the user has moved the camera
  let follows = false;
  let tip: THREE.Vector3 | null = null;
  const home = (towards = HOME): void => stage.look(homeBall(bodies).applyMatrix4(matrixOf(base)), towards);
  const fit = (): void => {
    const room = new THREE.Box3().setFromObject(figure.root, true);
    for (const mesh of [triads.world, triads.tool]) room.expandByPoint(new THREE.Vector3().setFromMatrixPosition(mesh.matrix));
    stage.look(room.getBoundingSphere(new THREE.Sphere()), stage.camera.position.clone().sub(stage.controls.target));
  };
  stage.controls.addEventListener("start", () => (touched = true));
  const action = (icon: Icon, label: string, hint: string, look: () => void): CameraAction => ({
    icon, label, hint,
    run: () => {
      touched = icon !== "home";
      look();
    },
  });
  const cameras: CameraAction[] = [
    action("home", "Home", "Look at the robot as when the page began", home),
    action("fit", "Fit", "Have all of the robot in the picture", fit),
    action("front", "Front", "Look from the front, along -X", () => home(DIRECTIONS.front)),
    action("right", "Side", "Look from the robot's right, along Y", () => home(DIRECTIONS.side)),
    action("top", "Top", "Look from above", () => home(DIRECTIONS.top)),
    {
      icon: "tool", label: "Follow the tool", hint: "Keep the tool where it is in the picture", on: () => follows,
      run: () => {
        [follows, tip] = [!follows, null];
        stage.change();
      },
    },
  ];
  home();
  void bodies.ready.then(() => (touched ? stage.change(true) : home()));
  new ResizeObserver(() => touched || home()).observe(stage.view);

  // --- each moment ---
  let heard = true;
  const show = (shown: Shown): void => {
    const { t, timeline, tool, q } = shown;
    const T_world_robot = timeline.base(t);
    const hand = timeline.hand(t, parts && ((at) => source.world.opening(at)));
    const here: InWorld = { ...shown, T_world_robot, T_world_tool: multiply(T_world_robot, tool), hand };
    const hears = !connection || connection.state === "open";
    if (drawn.to(`${q} ${hand} ${T_world_robot} ${tool} ${hears}`)) {
      draw(here);
      if (hears !== heard) model.joints.concat(model.joints[0]).forEach((_, i) => figure.paint(i, hears ? null : GREY));
      heard = hears;
      stage.change(true);
    }
    triads.tool.visible = framed && !gizmo.seen;
    for (const part of [parts, path, places, reasons, goal, prediction, measured, ranges, gizmo, branches, boundary]) if (part) part.show(here);
    if (!app.playback.moves) describe(here);
    stage.draw(app.playback.moves);
  };
  /** Describes the picture for screen readers: the tool, the held part, the places of parts, contacts. */
  const describe = ({ t, T_world_tool }: InWorld): void => {
    const [x, y, z] = originOf(T_world_tool).map((one) => fixed(1000 * one, 0));
    const text = ["the robot", `its tool is at X ${x} Y ${y} Z ${z} mm`, ...(parts?.told(t) ?? [])].join("; ");
    if (stage.view.ariaLabel !== text) stage.view.ariaLabel = text;
  };
  const draw = ({ frames, hand, T_world_robot, T_world_tool }: InWorld): void => {
    base = T_world_robot;
    figure.pose(frames, hand, T_world_robot);
    const height = scenery?.floor;
    setPose(stage.floor.root, height == null ? multiply(T_world_robot, stage.floor.T_robot_floor) : movedTo([0, 0, height]));
    setPose(triads.base, T_world_robot);
    setPose(triads.tool, T_world_tool);
    if (framed) {
      triads.base.visible = T_world_robot.some((x, i) => x !== identity()[i]);
      labels.set("frame world", "frame", "world", [0, 0, 0]);
      labels.set("frame tool", "frame", "tool", originOf(T_world_tool));
      if (triads.base.visible) labels.set("frame base", "frame", "base", originOf(T_world_robot));
      else labels.remove("frame base");
    }
    const place = new THREE.Vector3(...originOf(T_world_tool));
    if (follows && tip) stage.pan(place.clone().sub(tip));
    tip = place;
  };
  stage.view.addEventListener("keydown", (event) => {
    if (!gizmo.key(event)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  }, { capture: true });
  app.add({ show });
  return { stage, layers, cameras, gizmo, figure, ready: bodies.ready, explain: (sketch: Sketch | null) => reasons.explain(sketch) };
}
