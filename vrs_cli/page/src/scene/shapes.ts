import * as THREE from "three";
import { RoundedBoxGeometry } from "three/examples/jsm/geometries/RoundedBoxGeometry.js";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import type { Shape } from "../core/kinematics";

const BEVEL = 0.06; // of the smallest size of a body: width of its bevels
const SIDES = 40; // sides of a full circle
const HALF = SIDES / 2;

const vector = (a: number[]): THREE.Vector3 => new THREE.Vector3(a[0], a[1], a[2]);
const pair = (of: number | number[] | undefined): [number, number] => (Array.isArray(of) ? [of[0], of[1] ?? of[0]] : [of ?? 0, of ?? 0]);

/** Returns the matrix that turns Y to the direction from a to b, and moves the origin to a. */
function upright(a: THREE.Vector3, b: THREE.Vector3): THREE.Matrix4 {
  const turn = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 1, 0), b.clone().sub(a).normalize());
  return new THREE.Matrix4().compose(a, turn, new THREE.Vector3(1, 1, 1));
}

/** Rotates profiles (radius, height) about Y; each has its own edges. */
const lathe = (profiles: [number, number][][]): THREE.BufferGeometry =>
  mergeGeometries(profiles.map((profile) => new THREE.LatheGeometry(profile.map(([r, z]) => new THREE.Vector2(r, z)), SIDES)));

/** Returns a meridian arc of a ball between two angles from its top. */
function arc(r: number, height: number, from: number, to: number): [number, number][] {
  const count = Math.max(2, Math.ceil((Math.abs(to - from) / Math.PI) * HALF));
  return Array.from({ length: count + 1 }, (_, i) => {
    const angle = from + ((to - from) * i) / count;
    return [Math.max(0, r * Math.sin(angle)), height + r * Math.cos(angle)];
  });
}

function box(shape: Shape): THREE.BufferGeometry {
  const [x, y, z] = shape.size!;
  const made = new RoundedBoxGeometry(x, y, z, 1, BEVEL * Math.min(x, y, z));
  const { at } = shape;
  if (at?.length === 12) made.applyMatrix4(new THREE.Matrix4().fromArray([...at, 0, 0, 0, 1]).transpose());
  else if (at) made.translate(at[0], at[1], at[2]);
  return made;
}

function cylinder(a: THREE.Vector3, b: THREE.Vector3, [low, high]: [number, number]): THREE.BufferGeometry {
  const length = a.distanceTo(b);
  const bevel = BEVEL * Math.min(length, low, high);
  const slope = ((high - low) / length) * bevel;
  const corners: [number, number][] = [[0, 0], [low - bevel, 0], [low + slope, bevel], [high - slope, length - bevel], [high - bevel, length], [0, length]];
  return lathe(corners.slice(1).map((corner, i) => [corners[i], corner])).applyMatrix4(upright(a, b));
}

/** Makes two caps and the cone that touches both balls; only the larger ball if it contains the other. */
function capsule(a: THREE.Vector3, b: THREE.Vector3, [low, high]: [number, number]): THREE.BufferGeometry {
  const length = a.distanceTo(b);
  if (length <= Math.abs(low - high)) {
    const [{ x, y, z }, r] = low >= high ? [a, low] : [b, high];
    return new THREE.SphereGeometry(r, SIDES, HALF).translate(x, y, z);
  }
  const edge = Math.acos((low - high) / length); // angle of the cone's edge from the top of each ball
  return lathe([[...arc(low, 0, Math.PI, edge), ...arc(high, length, edge, 0)]]).applyMatrix4(upright(a, b));
}

/** Makes the hull of two discs; its thickness is linear from one to the other. */
function slab(shape: Shape, a: THREE.Vector3, b: THREE.Vector3, [low, high]: [number, number]): THREE.BufferGeometry {
  const length = a.distanceTo(b);
  const [first, last] = pair(shape.thickness);
  const edge = Math.acos(Math.min(1, Math.max(-1, (low - high) / length)));
  const bevel = BEVEL * Math.min(low, high, first, last);
  const outline = new THREE.Shape();
  outline.absarc(0, 0, low - bevel, edge, 2 * Math.PI - edge, false);
  outline.absarc(length, 0, high - bevel, -edge, edge, false);
  const options = { depth: 1 - BEVEL, bevelSize: bevel, bevelThickness: BEVEL / 2, bevelSegments: 1, curveSegments: HALF };
  const made = new THREE.ExtrudeGeometry(outline, options).translate(0, 0, (BEVEL - 1) / 2);
  const points = made.getAttribute("position");
  for (let i = 0; i < points.count; i++) {
    const part = (points.getX(i) + low) / (length + low + high);
    points.setZ(i, points.getZ(i) * (first + (last - first) * part));
  }
  made.computeVertexNormals();
  const x = b.clone().sub(a).normalize();
  const across = vector(shape.across!);
  const z = across.sub(x.clone().multiplyScalar(x.dot(across))).normalize(); // perpendicular to x, as close to `across` as possible
  return made.applyMatrix4(new THREE.Matrix4().makeBasis(x, z.clone().cross(x), z).setPosition(a));
}

/** Returns the surface of a body of a robot (docs/robots.md, all kinds but `mesh`) in the frame of its link [m]. */
export function geometry(shape: Shape): THREE.BufferGeometry {
  if (shape.kind === "box") return box(shape);
  const [a, b, radii] = [vector(shape.from!), vector(shape.to ?? shape.from!), pair(shape.radius)];
  if (shape.kind === "cylinder") return cylinder(a, b, radii);
  if (shape.kind === "capsule") return capsule(a, b, radii);
  return slab(shape, a, b, radii);
}
