import * as THREE from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import type { Point } from "../core/transform";

const ALL = 1000; // [s] longer than the times of all pieces that are drawn together
const BEHIND = 6; // [px] of depth that lines lie behind the dots on them

/** A piece of a line: two points in the world [m], and the times there [s]; of a dashed line, how far they are along it. */
export interface Piece {
  a: Point;
  b: Point;
  from: number;
  to: number;
  colour: THREE.Color;
}

/** Many pieces of lines that are a few pixels wide, drawn at once. */
export class Lines {
  readonly mesh: LineSegments2;
  private readonly material: LineMaterial;
  private origin = 0; // [s] times are stored from here on, so that they keep their precision

  /** `linewidth`: of the lines [px]; `dash`: how long dashes and the gaps between them are, 0 for whole lines. */
  constructor(linewidth: number, dash = 0) {
    this.material = new LineMaterial({
      linewidth, vertexColors: true, dashed: dash > 0, dashSize: dash, gapSize: dash, polygonOffset: true, polygonOffsetFactor: BEHIND, polygonOffsetUnits: 1,
    });
    this.mesh = new LineSegments2(undefined, this.material);
    this.mesh.frustumCulled = this.mesh.visible = false;
  }

  set(pieces: Piece[]): void {
    this.mesh.geometry.dispose();
    this.mesh.visible = pieces.length > 0;
    if (!pieces.length) return;
    const made = (this.mesh.geometry = new LineSegmentsGeometry());
    made.setPositions(pieces.flatMap(({ a, b }) => [...a, ...b])).setColors(pieces.flatMap(({ colour }) => [...colour, ...colour]));
    this.origin = pieces[0].from;
    const times = new THREE.InstancedInterleavedBuffer(Float32Array.from(pieces.flatMap(({ from, to }) => [from - this.origin, to - this.origin])), 2);
    ["instanceDistanceStart", "instanceDistanceEnd"].forEach((name, i) => made.setAttribute(name, new THREE.InterleavedBufferAttribute(times, 1, i)));
  }

  /** Draws only what is before a time [s], or after it: as one dash that ends, or begins, there. */
  showUntil(t: number): void {
    this.showFrom(t - ALL);
  }
  showFrom(t: number): void {
    Object.assign(this.material, { dashed: true, dashSize: ALL, gapSize: ALL, dashOffset: this.origin - t });
  }
}

/** Round dots of a size in pixels. */
export class Dots {
  readonly points: THREE.Points<THREE.BufferGeometry, THREE.PointsMaterial>;

  constructor(size: number) {
    const material = new THREE.PointsMaterial({ size, sizeAttenuation: false });
    material.onBeforeCompile = (shader) => {
      shader.fragmentShader = shader.fragmentShader.replace("void main() {", "void main() {\n if (length(gl_PointCoord - 0.5) > 0.5) discard;");
    };
    this.points = new THREE.Points(new THREE.BufferGeometry(), material);
    this.points.frustumCulled = false;
  }

  set(places: Point[], colour: string): void {
    this.points.geometry.dispose();
    this.points.geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(places.flat(), 3));
    this.points.material.color.set(colour);
    this.points.visible = places.length > 0;
  }
}
