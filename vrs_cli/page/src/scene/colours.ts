import { Color } from "three";

/** Colours of the picture that follow the theme of the page; those of the robot itself do not. `cell`, `section`, `numbers`:
 * of the floor, its lines each 100 mm and each 500 mm. `past` to `plannedBlend`: of the way of the tool, and where one motion
 * turns into the next. `shadow`: how dark it is, from 0 to 1. */
export type Palette = typeof LIGHT;

const LIGHT = {
  background: "#f1f3f5", sky: "#ffffff", ground: "#a8a49e", cell: "#dde1e5", section: "#b9c0c8", numbers: "#66707c", shadow: 0.22,
  past: "#1d58c8", planned: "#e0660a", pastBlend: "#7fa5ec", plannedBlend: "#f6ac66", dot: "#6f767f", mark: "#30363d",
  goal: "#c65a06", good: "#22864a", bad: "#d63031", stop: "#8c1414", free: "#6c9ed6", hand: "#343a42", reach: "#4682d2",
  unconfirmed: "#e6b400", flagged: "#d62020", predicted: "#3a7cd6", measured: "#a3246b", branches: ["#8c60c8", "#3c9696", "#be5a82"],
};
const DARK: Palette = {
  background: "#171b21", sky: "#dfe6f0", ground: "#4c4a48", cell: "#262c34", section: "#3d4651", numbers: "#93a0af", shadow: 0.5,
  past: "#5b93ff", planned: "#ff8b3d", pastBlend: "#b4ccff", plannedBlend: "#ffc79c", dot: "#98a2ae", mark: "#e8ecf1",
  goal: "#ff9d4d", good: "#4cc47c", bad: "#ff6b66", stop: "#ff4d4d", free: "#6c9ed6", hand: "#e4e8ee", reach: "#5f9cf0",
  unconfirmed: "#f0c420", flagged: "#ff5050", predicted: "#5f9cf0", measured: "#f58bc3", branches: ["#b08ce8", "#55bcbc", "#e080a6"],
};

/** Colours of the axes of frames: X, Y, Z. */
export const AXES = ["#d1342f", "#2e9e4f", "#2f6fde"].map((colour) => new Color(colour));

/** The colours of shapes by their names in the robot's file. */
const SHAPES: Record<string, string> = {
  cream: "#f0e8d4", white: "#f0f1f3", grey: "#b0b5bc", dark: "#3e434a", steel: "#9298a0",
  orange: "#e27a2a", blue: "#5486be", red: "#be3e36", yellow: "#ecbe3c", green: "#5c9660",
};

/** Returns the colour of a shape by its name, or by #rrggbb. */
export const shapeColour = (name = "cream"): Color => new Color(SHAPES[name] ?? name);

/** Returns the colours of a theme. */
export const palette = (dark: boolean): Palette => (dark ? DARK : LIGHT);
