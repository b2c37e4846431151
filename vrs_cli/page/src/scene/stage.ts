import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Transform } from "../core/transform";
import { h } from "../dom";
import { isDark, onTheme } from "../style/theme";
import { makeCamera, placeCamera } from "./camera";
import { palette, type Palette } from "./colours";
import { Labels } from "./labels";
import { QualityControl } from "./quality";

THREE.Object3D.DEFAULT_UP.set(0, 0, 1);

const MARGIN = 1.12; // of the radius: room around the arm in the picture
const KEY = new THREE.Vector3(0.45, -0.28, 0.85).normalize(); // direction of the lamp: above, behind the robot's right shoulder
const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i;
const FIRST_OF_SOFTWARE = 3; // first quality on a machine without a GPU
const REST = 350; // [ms] without a change before a still picture is drawn with more pixels
const STILL = 2; // pixels of a still picture per CSS pixel

const CELL = 0.1; // [m] between the lines of the floor
const SECTION = 0.5; // [m] between lines with a number
const BELOW = 0.0005; // [m] of the floor below the foot of the robot, so that they do not flicker
const MAX_LETTER = 0.08; // [m] maximum size of numbers, so that they do not overlap
const TILE = [256, 64]; // [px] size of a number in the texture

/** The floor: lines, numbers in mm along X and Y, and the shadow of the robot. */
class Floor {
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
      // text runs along Y with its foot towards X, so that a viewer in front of the robot can read it
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

/** The canvas with its camera, floor and lights. It is drawn only after changes. */
export class Stage {
  readonly scene = new THREE.Scene();
  readonly camera = makeCamera();
  readonly controls: OrbitControls;
  /** The element with the canvas and the labels above it. */
  readonly view = h("div", { class: "scene", tabindex: "0", role: "img", "aria-label": "the robot" });
  readonly floor: Floor;
  readonly labels: Labels;
  /** Number of drawn pictures. */
  pictures = 0;
  colours: Palette = palette(isDark());
  width = 1;
  height = 1;
  /** Called before each picture. */
  readonly beforeDraw = new Set<() => void>();
  readonly onPaint = new Set<(colours: Palette) => void>();
  private renderer!: THREE.WebGLRenderer;
  private readonly lamp = new THREE.DirectionalLight(0xffffff, 1.7);
  private readonly sky = new THREE.HemisphereLight(0xffffff, 0xffffff, 1.9);
  private readonly fill = new THREE.DirectionalLight(0xffffff, 0.8);
  private readonly quality = new QualityControl(SOFTWARE.test(rendererName()) ? FIRST_OF_SOFTWARE : 0);
  private dirty = true;
  private followed = false;
  private still = false;
  private timer = 0;

  /** `reach`, `foot`: the reach of the arm, and the height of its foot [m]. `wake` requests one picture. */
  constructor(slot: HTMLElement, readonly reach: number, foot: number, private readonly wake: () => void) {
    slot.append(this.view);
    this.labels = new Labels(this);
    this.floor = new Floor(reach, foot);
    this.lamp.position.copy(KEY).multiplyScalar(4 * reach);
    this.fill.position.set(0.6, 1, 0.35); // beside the viewer
    Object.assign(this.lamp.shadow.camera, { left: -1.6 * reach, right: 1.6 * reach, top: 1.6 * reach, bottom: -1.6 * reach, near: 0.5 * reach, far: 8 * reach });
    this.lamp.shadow.mapSize.set(2048, 2048);
    this.lamp.shadow.radius = 4;
    this.lamp.shadow.bias = -0.0005;
    this.lamp.castShadow = true;
    this.floor.root.add(this.lamp, this.lamp.target);
    this.scene.add(this.sky, this.fill, this.floor.root);
    this.makeRenderer();
    this.controls = new OrbitControls(this.camera, this.view);
    this.controls.listenToKeyEvents(this.view);
    this.controls.minDistance = 0.05 * reach;
    this.controls.maxDistance = 20 * reach;
    this.controls.addEventListener("change", () => this.change());
    this.view.addEventListener("keydown", (event) => {
      if (event.key === "+") this.controls.dollyIn(1.15);
      if (event.key === "-") this.controls.dollyOut(1.15);
    });
    onTheme(() => this.paint());
    this.paint();
    new ResizeObserver(() => this.resize()).observe(this.view);
    this.resize();
  }

  /** Requests the next picture; `shadow`: whether something that casts a shadow has moved. */
  change(shadow = false): void {
    this.dirty = true;
    if (shadow) this.renderer.shadowMap.needsUpdate = true;
    this.wake();
  }

  /** Draws the picture if something has changed. `moves`: whether the next one follows at once. */
  draw(moves: boolean): void {
    if (!this.dirty) {
      this.followed = false;
      return;
    }
    this.dirty = false;
    if (this.still) this.setRatio();
    for (const prepare of this.beforeDraw) prepare();
    this.renderer.render(this.scene, this.camera);
    this.pictures++;
    if (this.quality.drawn(performance.now(), this.followed)) this.refine();
    this.followed = moves;
    window.clearTimeout(this.timer);
    if (!this.quality.quality.antialias) this.timer = window.setTimeout(() => this.drawStill(), REST);
  }

  /** Draws a still picture with more pixels, which the browser smooths. */
  private drawStill(): void {
    if (this.dirty || document.hidden) return;
    this.setRatio(STILL);
    this.renderer.render(this.scene, this.camera);
  }

  /** Sets the pixels per CSS pixel: those of the quality, or of a still picture. */
  private setRatio(still = 0): void {
    this.still = still > 0;
    this.renderer.setPixelRatio(still || Math.min(devicePixelRatio, this.quality.quality.ratio));
    this.renderer.setSize(this.width, this.height, false);
  }

  /** The quality of the picture, 0 the finest, for tests and measurements. */
  get level(): number {
    return this.quality.level;
  }

  /** Draws all pictures in one quality from now on, 0 the finest. */
  fix(level: number): void {
    Object.assign(this.quality, { level, fixed: true });
    this.refine();
  }

  /** Points the camera at a ball from a direction, so that all of it is visible. */
  look(ball: THREE.Sphere, towards: THREE.Vector3): void {
    placeCamera(this.camera, ball, towards, MARGIN);
    this.controls.target.copy(ball.center);
    this.controls.update();
    this.change();
  }

  /** Moves the camera and its target. */
  pan(by: THREE.Vector3): void {
    this.camera.position.add(by);
    this.controls.target.add(by);
    this.controls.update();
    this.change();
  }

  /** Makes a canvas. Antialiasing cannot be changed later, so another quality may need another canvas. */
  private makeRenderer(): void {
    this.renderer?.dispose();
    this.renderer?.domElement.remove();
    const canvas = document.createElement("canvas");
    // three.js itself would request a canvas with alpha, which browsers blend with the page below
    const context = canvas.getContext("webgl2", { alpha: false, antialias: this.quality.quality.antialias, stencil: true, powerPreference: "low-power" });
    this.renderer = new THREE.WebGLRenderer({ canvas, context: context ?? undefined });
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.renderer.shadowMap.autoUpdate = false;
    this.renderer.domElement.setAttribute("aria-hidden", "true"); // the view has its own text
    this.view.prepend(this.renderer.domElement);
    this.applyQuality();
  }

  private refine(): void {
    const antialias = this.renderer.getContextAttributes()?.antialias ?? false;
    if (antialias !== this.quality.quality.antialias) this.makeRenderer();
    this.applyQuality();
    this.resize();
  }

  private applyQuality(): void {
    const { shadow } = this.quality.quality;
    this.renderer.shadowMap.enabled = shadow;
    this.renderer.shadowMap.needsUpdate = true;
    this.lamp.castShadow = shadow;
    this.floor.shadow = shadow;
  }

  private paint(): void {
    this.colours = palette(isDark());
    this.renderer.setClearColor(this.colours.background);
    this.sky.color.set(this.colours.sky);
    this.sky.groundColor.set(this.colours.ground);
    this.floor.paint(this.colours);
    for (const paint of this.onPaint) paint(this.colours);
    this.change();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.view;
    if (!width || !height) return;
    [this.width, this.height] = [width, height];
    this.setRatio();
    this.renderer.setClearColor(this.colours.background);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.change(true);
  }
}

/** Returns the browser's name of the renderer. */
function rendererName(): string {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = String(info && gl!.getParameter(info.UNMASKED_RENDERER_WEBGL));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return name;
}
