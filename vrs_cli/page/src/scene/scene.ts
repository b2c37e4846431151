import type { App, Shown } from "../app";
import type { Message } from "../core/connection";
import { h } from "../dom";
import { Figure } from "./figure";
import { Gizmo } from "./gizmo";
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
  /** Draws a report of WHY or EXPLAIN (or `sketch`es of it) until the timeline changes; null takes it away. */
  explain(report: Message | null): void;
}

/** Makes the picture of the robot. */
export function makeScene(app: App, slot: HTMLElement): Scene {
  const canvas = h("canvas", { "aria-label": "the robot" });
  slot.append(canvas);
  const stage = new Stage(canvas, () => app.wake());
  const figure = new Figure(app.source.model);
  stage.scene.add(figure.root);
  const layer = (name: string, label: string, hint: string, on: boolean): Layer => ({
    name, label, hint, on,
    set(to: boolean) {
      Object.assign(this, { on: to });
      stage.change();
    },
  });
  const layers = [
    layer("path", "Path", "The way of the tool: past blue, planned orange, lighter where motions blend", true),
    layer("commands", "Commands", "The text of each command where its motion begins", false),
    layer("goal", "Goal", "The outline of the arm as it will stand when the motion ends", true),
    layer("branches", "Branches", "The arm as other branches move it", true),
    layer("places", "Places", "The locations that have names", true),
    layer("ranges", "Joint ranges", "How far each joint goes, and where it is", false),
    layer("reach", "Reach", "How far the tool gets in this configuration", false),
    layer("frames", "Frames", "The axes of world, base and tool", true),
  ];
  const action = (name: CameraAction["name"], label: string, hint: string): CameraAction => ({ name, label, hint, run: () => stage.change() });
  const cameras = [
    action("home", "Home", "Look at the robot from where the page began"),
    action("fit", "Fit", "Have all that is drawn in the picture"),
    action("front", "Front", "Look along -X"),
    action("side", "Side", "Look along Y"),
    action("top", "Top", "Look down"),
    action("follow", "Follow the tool", "Keep the tool in the middle of the picture"),
  ];
  let drawn: number[] = [];
  app.add({
    show({ q, frames }: Shown) {
      if (q.some((x, i) => x !== drawn[i])) {
        figure.pose(frames);
        stage.change();
        drawn = q;
      }
      stage.draw();
    },
  });
  return { stage, layers, cameras, gizmo: new Gizmo(), explain: () => {} };
}
