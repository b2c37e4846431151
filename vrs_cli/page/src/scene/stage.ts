import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

THREE.Object3D.DEFAULT_UP.set(0, 0, 1);

/** The canvas with its camera and lights. It is drawn only when something has changed. */
export class Stage {
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(45, 1, 0.01, 50);
  readonly renderer: THREE.WebGLRenderer;
  readonly controls: OrbitControls;
  private dirty = true;

  constructor(readonly canvas: HTMLCanvasElement, private readonly wake: () => void) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: "low-power" });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = true;
    this.scene.background = new THREE.Color(0xf4f5f7);
    const light = new THREE.DirectionalLight(0xffffff, 2.2);
    light.position.set(1.5, -2, 3);
    light.castShadow = true;
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 1.6), light);
    const grid = new THREE.GridHelper(4, 40, 0x9aa3b0, 0xd5dae1);
    grid.rotateX(Math.PI / 2);
    this.scene.add(grid);
    this.camera.position.set(1.6, -1.9, 1.1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.set(0, 0, 0.1);
    this.controls.addEventListener("change", () => this.change());
    this.controls.update();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  /** Has the next frame drawn. */
  change(): void {
    this.dirty = true;
    this.wake();
  }

  draw(): void {
    if (!this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.change();
  }
}
