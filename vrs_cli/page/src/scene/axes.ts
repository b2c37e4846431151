import * as THREE from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { AXES } from "./colours";
import { matrixOf, plain } from "./figure";

const MATERIAL = new THREE.MeshBasicMaterial({ vertexColors: true });
const TURNS = [new THREE.Matrix4().makeRotationZ(-Math.PI / 2), new THREE.Matrix4(), new THREE.Matrix4().makeRotationX(Math.PI / 2)];

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
