import type { App, Shown } from "../app";
import { h } from "../dom";
import { Figure } from "./figure";
import { Stage } from "./stage";

/** Makes the picture of the robot. */
export function makeScene(app: App, slot: HTMLElement): Stage {
  const canvas = h("canvas", { "aria-label": "the robot" });
  slot.append(canvas);
  const stage = new Stage(canvas, () => app.wake());
  const figure = new Figure(app.source.model);
  stage.scene.add(figure.root);
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
  return stage;
}
