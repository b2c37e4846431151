import * as THREE from "three";
import type { Transform } from "../core/transform";
import type { Palette } from "./colours";

const CELL = 0.1; // [m] between the lines of the floor
const SECTION = 0.5; // [m] between those that have a number
const BELOW = 0.0005; // [m] the floor lies lower than the foot of the robot, which would flicker in it
const MAX_LETTER = 0.08; // [m] so that numbers do not run into each other
const TILE = [256, 64]; // [px] of a number in the texture

/** The floor: lines, numbers in mm along X and Y, and the shadow of the robot. */
export class Floor {
  readonly root = new THREE.Group();
  readonly T_robot_floor: Transform;
  private readonly grids: THREE.GridHelper[];
  private readonly numbers: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
  private readonly shade: THREE.Mesh<THREE.BufferGeometry, THREE.ShadowMaterial>;
  private readonly half: number;
  private readonly texts: string[] = [];

  /** `reach`: of the arm [m]; `height` of its foot [m]. */
  constructor(reach: number, height: number) {
    this.half = SECTION * Math.ceil((1.3 * reach) / SECTION);
    this.T_robot_floor = Float64Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, height - BELOW);
    this.grids = [CELL, SECTION].map((step) => new THREE.GridHelper(2 * this.half, Math.round((2 * this.half) / step)).rotateX(Math.PI / 2));
    for (const { material } of this.grids) material.vertexColors = false;
    this.numbers = new THREE.Mesh(this.tiles(Math.min(0.055 * reach, MAX_LETTER)), new THREE.MeshBasicMaterial({ transparent: true, depthWrite: false }));
    this.numbers.position.z = BELOW / 2;
    this.shade = new THREE.Mesh(new THREE.CircleGeometry(1.5 * reach, 48), new THREE.ShadowMaterial({ depthWrite: false }));
    this.shade.receiveShadow = true;
    this.root.add(...this.grids, this.shade, this.numbers);
  }

  /** Makes a rectangle for each number, beside the lines through the origin. */
  private tiles(letter: number): THREE.BufferGeometry {
    const places: [number, number][] = [];
    const count = Math.round(this.half / SECTION);
    for (let k = -count; k <= count; k++) {
      if (!k) continue;
      for (const axis of ["X", "Y"]) {
        this.texts.push(k < count ? `${Math.round(1000 * SECTION * k)}` : `${axis} mm`);
        places.push(axis === "X" ? [SECTION * k - letter, 2 * letter] : [letter, SECTION * k]);
      }
    }
    const rows = this.texts.length;
    const [high, wide] = [1.6 * letter, (1.6 * letter * TILE[0]) / TILE[1]];
    const positions: number[] = [], uvs: number[] = [], index: number[] = [];
    places.forEach(([x, y], i) => {
      // text runs along Y, its foot to X, so that who stands before the robot reads it
      positions.push(x + high / 2, y - wide / 2, 0, x + high / 2, y + wide / 2, 0, x - high / 2, y + wide / 2, 0, x - high / 2, y - wide / 2, 0);
      const [low, up] = [1 - (i + 1) / rows, 1 - i / rows];
      uvs.push(0, low, 1, low, 1, up, 0, up);
      index.push(...[0, 1, 2, 0, 2, 3].map((k) => 4 * i + k));
    });
    return new THREE.BufferGeometry()
      .setAttribute("position", new THREE.Float32BufferAttribute(positions, 3))
      .setAttribute("uv", new THREE.Float32BufferAttribute(uvs, 2))
      .setIndex(index);
  }

  paint(colours: Palette): void {
    this.grids.forEach(({ material }, i) => material.color.set([colours.cell, colours.section][i]));
    this.shade.material.opacity = colours.shadow;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [TILE[0], TILE[1] * this.texts.length];
    const pen = canvas.getContext("2d")!;
    pen.font = `${0.62 * TILE[1]}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillStyle = colours.numbers;
    this.texts.forEach((text, i) => pen.fillText(text, TILE[0] / 2, TILE[1] * (i + 0.5)));
    this.numbers.material.map?.dispose();
    this.numbers.material.map = new THREE.CanvasTexture(canvas);
    this.numbers.material.map.colorSpace = THREE.SRGBColorSpace;
    this.numbers.material.map.anisotropy = 4;
    this.numbers.material.needsUpdate = true;
  }

  set shadow(on: boolean) {
    this.shade.visible = on;
  }
}
