import * as THREE from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import type { Model, Shape } from "../core/kinematics";
import type { Transform } from "../core/transform";
import { COLOURS, geometry } from "./shapes";

/** Sets the pose of an object that is not moved otherwise. */
export function setPose(object: THREE.Object3D, T: Transform): void {
  object.matrix.set(T[0], T[1], T[2], T[3], T[4], T[5], T[6], T[7], T[8], T[9], T[10], T[11], 0, 0, 0, 1);
  object.matrixWorldNeedsUpdate = true;
}

/** The arm: a group for each link, with its shapes. */
export class Figure {
  readonly root = new THREE.Group();
  private readonly links: THREE.Group[] = [];

  constructor(model: Model) {
    for (let i = 0; i <= model.joints.length; i++) {
      const link = new THREE.Group();
      link.matrixAutoUpdate = false;
      this.links.push(link);
      this.root.add(link);
    }
    const groups = new Map<string, Shape[]>();
    for (const shape of model.shapes ?? []) {
      if (shape.kind === "mesh") continue;
      const key = `${shape.link} ${shape.colour ?? "cream"}`;
      groups.set(key, [...(groups.get(key) ?? []), shape]);
    }
    for (const [first, ...others] of groups.values()) {
      const parts = [first, ...others].map(geometry).map((g) => {
        const plain = g.index ? g.toNonIndexed() : g;
        plain.deleteAttribute("uv");
        return plain;
      });
      const colour = first.colour ?? "cream";
      const material = new THREE.MeshStandardMaterial({ color: COLOURS[colour] ?? colour, roughness: 0.6 });
      const mesh = new THREE.Mesh(mergeGeometries(parts), material);
      mesh.castShadow = true;
      this.links[first.link].add(mesh);
    }
  }

  pose(frames: Transform[]): void {
    frames.forEach((T, i) => setPose(this.links[i], T));
  }
}
