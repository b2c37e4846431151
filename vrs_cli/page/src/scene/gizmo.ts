import type { Transform } from "../core/transform";

/** Who else looks at the gizmo: the panel that drives the robot. */
export class Gizmo {
  /** Called with the wished T_world_tool while the gizmo is dragged (again at least each 100 ms), and with null when it is let go. */
  onDrag: (wish: Transform | null) => void = () => {};
  /** Whether the gizmo is seen: for one who may drive, while the robot is followed. */
  enabled = false;
  /** Whether the arrows stand along the axes of the tool or of the world. */
  axes: "tool" | "world" = "tool";
  /** What the gizmo can do. */
  motions: "both" | "move" | "turn" = "both";
  /** Whether somebody holds it now. */
  readonly dragged = false;
  /** Shows what holds the tool back: a text at the tool, and a ball at the joint (counted from 1; 0: none) at its limit. */
  showHeld(_text: string, _joint: number): void {}
  /** Lets go, as if the user did: at a cut of the connection. */
  drop(): void {}
}
