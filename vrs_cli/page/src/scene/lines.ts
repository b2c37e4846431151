import * as THREE from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import type { Point } from "../core/transform";
import { AXES } from "./colours";
import { matrixOf, plain } from "./figure";

const MATERIAL = new THREE.MeshBasicMaterial({ vertexColors: true });
const TURNS = [new THREE.Matrix4().makeRotationZ(-Math.PI / 2), new THREE.Matrix4(), new THREE.Matrix4().makeRotationX(Math.PI / 2)];
const ALL = 1000; // [s] longer than any drawn line
const BEHIND = 6; // [px] depth of lines behind their dots

/** A piece of a line: two points in the world [m], and their times [s]; of a dashed line, their distances along it. */
export interface Piece {
  a: Point;
  b: Point;
  from: number;
  to: number;
  colour: THREE.Color;
}

/** Many pieces of lines, a few pixels wide, drawn at once. */
export class Lines {
  readonly mesh: LineSegments2;
  private readonly material: LineMaterial;
  private origin = 0; // [s] origin of the stored times, which keeps their precision

  /** `linewidth` [px]; `dash`: length of dashes and gaps, 0: solid lines. */
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

  /** Draws only the part before a time [s] (`past`), or the part after it, as one dash. */
  split(t: number, past: boolean): void {
    const here = Math.min(Math.max(t - this.origin, -ALL / 2), ALL / 2);
    Object.assign(this.material, { dashed: true, dashSize: ALL, gapSize: ALL, dashOffset: (past ? ALL : 0) - here });
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

/** Returns the axes X red, Y green, Z blue as thin rods of this length [m]. */
export function axesGeometry(length: number): THREE.BufferGeometry {
  const rods = TURNS.map((turn, i) => {
    const rod = new THREE.CylinderGeometry(0.02 * length, 0.02 * length, length, 8).translate(0, length / 2, 0).applyMatrix4(turn);
    return plain(rod, AXES[i]);
  });
  return mergeGeometries(rods);
}

/** Makes the axes of a frame; setPose moves it. */
export function axes(length: number): THREE.Mesh {
  const made = new THREE.Mesh(axesGeometry(length), MATERIAL);
  made.matrixAutoUpdate = false;
  return made;
}

/** Makes axes of many frames, drawn at once. */
export class AxesCloud {
  readonly root = new THREE.Group();
  private mesh: THREE.InstancedMesh | null = null;

  constructor(private readonly length: number) {}

  show(poses: ArrayLike<number>[]): void {
    this.mesh?.geometry.dispose();
    this.mesh?.dispose();
    this.root.clear();
    this.mesh = null;
    if (!poses.length) return;
    this.mesh = new THREE.InstancedMesh(axesGeometry(this.length), MATERIAL, poses.length);
    poses.forEach((T, i) => this.mesh!.setMatrixAt(i, matrixOf(T)));
    this.root.add(this.mesh);
  }
}
