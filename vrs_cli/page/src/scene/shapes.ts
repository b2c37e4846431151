// Shapes of links as geometries of three.js, in the frame of the link [m].
import * as THREE from "three";
import { RoundedBoxGeometry } from "three/examples/jsm/geometries/RoundedBoxGeometry.js";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import type { Shape } from "../core/kinematics";
export const COLOURS: Record<string, number> = { cream: 0xf0e8d4, white: 0xf0f1f3, grey: 0xb0b5bc, dark: 0x3e434a, steel: 0x92989f, orange: 0xe27a2a, blue: 0x5486be, red: 0xbe3e36, yellow: 0xecbe3c, green: 0x5c9660 };
const BEVEL = 0.06, SIDES = 40, v = (a: number[]) => new THREE.Vector3(...(a as [number, number, number]));
const two = (r: number | number[] | undefined): [number, number] => (Array.isArray(r) ? [r[0], r[1] ?? r[0]] : [r!, r!]);
/** y of a lathe to the way from a to b. */
function upright(a: THREE.Vector3, b: THREE.Vector3) {
  const q = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 1, 0), b.clone().sub(a).normalize());
  return new THREE.Matrix4().compose(a, q, new THREE.Vector3(1, 1, 1));
}
function lathe(bands: [number, number][][]) {
  return mergeGeometries(bands.map((b) => new THREE.LatheGeometry(b.map(([r, z]) => new THREE.Vector2(r, z)), SIDES)))!;
}
export function geometry(s: Shape): THREE.BufferGeometry {
  if (s.kind === "box") {
    const [x, y, z] = s.size!, g = new RoundedBoxGeometry(x, y, z, 1, BEVEL * Math.min(x, y, z));
    if (s.at) g.applyMatrix4(s.at.length === 12 ? new THREE.Matrix4().fromArray([...s.at, 0, 0, 0, 1]).transpose() : new THREE.Matrix4().makeTranslation(v(s.at)));
    return g;
  }
  const a = v(s.from!), b = v(s.to ?? s.from!), [r1, r2] = two(s.radius), length = a.distanceTo(b);
  if (s.kind === "cylinder") {
    const e = BEVEL * Math.min(length, r1, r2), slope = ((r2 - r1) / length) * e;
    const c: [number, number][] = [[0, 0], [r1 - e, 0], [r1 + slope, e], [r2 - slope, length - e], [r2 - e, length], [0, length]];
    return lathe(c.slice(1).map((p, i) => [c[i], p])).applyMatrix4(upright(a, b));
  }
  if (s.kind === "capsule") {
    if (length <= Math.abs(r1 - r2)) return new THREE.SphereGeometry(Math.max(r1, r2), SIDES, SIDES / 2).translate(a.x, a.y, a.z);
    const edge = Math.acos((r1 - r2) / length), p: [number, number][] = [];
    for (let i = 0; i <= 12; i++) { const w = Math.PI + ((edge - Math.PI) * i) / 12; p.push([r1 * Math.sin(w), r1 * Math.cos(w)]); }
    for (let i = 0; i <= 12; i++) { const w = edge - (edge * i) / 12; p.push([r2 * Math.sin(w), length + r2 * Math.cos(w)]); }
    return lathe([p]).applyMatrix4(upright(a, b));
  }
  // slab: the hull of two discs, its thickness linear from one to the other
  const [t1, t2] = two(s.thickness), edge = Math.acos(Math.min(1, Math.max(-1, (r1 - r2) / length))), e = BEVEL * Math.min(r1, r2, t1, t2);
  const o = new THREE.Shape();
  o.absarc(0, 0, r1 - e, edge, 2 * Math.PI - edge, false);
  o.absarc(length, 0, r2 - e, -edge, edge, false);
  const g = new THREE.ExtrudeGeometry(o, { depth: 1 - 0.06, bevelSize: e, bevelThickness: 0.03, bevelSegments: 1, curveSegments: SIDES / 2 }).translate(0, 0, -0.47);
  const p = g.attributes.position;
  for (let i = 0; i < p.count; i++) p.setZ(i, p.getZ(i) * (t1 + ((t2 - t1) * (p.getX(i) + r1)) / (length + r1 + r2)));
  g.computeVertexNormals();
  const x = b.clone().sub(a).normalize(), across = v(s.across!), z = across.sub(x.clone().multiplyScalar(x.dot(across))).normalize();
  return g.applyMatrix4(new THREE.Matrix4().makeBasis(x, z.clone().cross(x), z).setPosition(a));
}
