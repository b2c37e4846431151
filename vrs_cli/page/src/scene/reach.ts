import * as THREE from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { Change } from "../core/change";
import type { Connection } from "../core/connection";
import { DEGREES, linkAfter, slides } from "../core/kinematics";
import { identity, movePoint, multiply, rotation } from "../core/transform";
import { matrixOf, setPose, type Bodies, type Figure } from "./figure";
import type { InWorld } from "./scene";
import type { Stage } from "./stage";

const END = "#d64e3e"; // colour of the ends of a range
const [LARGEST, SMALLEST] = [0.2, 0.1]; // of the reach: radius of the first and of the last joint's arc
const WIDE = 0.16; // of the radius: width of an arc
const WINDS = 0.1; // of the radius: growth of an arc per half turn, so that several turns form a spiral
const ABOVE = 0.004; // [m] height above the bodies of its link
const FINEST = (5 * Math.PI) / 180; // [rad] maximum angle between corners of an arc
const NEAR = 0.05; // of its range: distance from the end at which a joint is marked
const Z = [0, 0, 1];

const flat = (colour: string, more: THREE.MeshBasicMaterialParameters = {}): THREE.MeshBasicMaterial =>
  new THREE.MeshBasicMaterial({ color: colour, side: THREE.DoubleSide, ...more });

/** Returns the surface between two lines with equal numbers of points. */
function ribbon(first: number[][], second: number[][]): THREE.BufferGeometry {
  const index: number[] = [];
  const count = first.length;
  for (let k = 0; k + 1 < count; k++) index.push(k, k + count + 1, k + 1, k, k + count, k + count + 1);
  return new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute([...first, ...second].flat(), 3)).setIndex(index);
}

/** Returns a ribbon between two angles at a height, a spiral outwards from the lower end of the range. */
function sector(from: number, to: number, lower: number, radius: number, height: number): THREE.BufferGeometry {
  const count = Math.max(2, Math.ceil((to - from) / FINEST) + 1);
  const rim = (share: number): number[][] =>
    Array.from({ length: count }, (_, k) => {
      const angle = from + ((to - from) * k) / (count - 1);
      const r = share * radius * (1 + (WINDS * (angle - lower)) / Math.PI);
      return [r * Math.cos(angle), r * Math.sin(angle), height];
    });
  return ribbon(rim(1 - WIDE), rim(1));
}

/** Returns a long triangle along x. */
const needle = (near: number, far: number): THREE.BufferGeometry =>
  new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute([near, -0.06 * far, 0, far, 0, 0, near, 0.06 * far, 0], 3));

interface Scale {
  hand: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
  tip: number;
  height: number;
}

/** The range of each joint as an arc about its axis (a rail if it slides), with a hand at its value. It is made when first visible. */
export class RangesView {
  private readonly root: THREE.Object3D[] = [];
  private scales: Scale[] = [];
  private free = flat("#fff");
  private on = false;

  constructor(private readonly stage: Stage, private readonly bodies: Bodies, private readonly figure: Figure) {}

  set visible(on: boolean) {
    this.on = on;
    if (on && !this.scales.length) this.scales = this.bodies.model.joints.map((_, i) => this.make(i));
    for (const node of this.root) node.visible = on;
    if (!on) this.stage.labels.remove("joint ");
  }

  private make(i: number): Scale {
    const { joints } = this.bodies.model;
    const { lower, upper, theta = 0, d } = joints[i];
    const size = this.stage.reach * (LARGEST + ((SMALLEST - LARGEST) * i) / Math.max(joints.length - 1, 1));
    const straight = slides(joints[i]);
    const end = straight ? NEAR * (upper - lower) : Math.min(NEAR * (upper - lower), Math.PI / 12);
    const cuts = [lower, lower + end, upper - end, upper];
    let height = d, parts: THREE.BufferGeometry[];
    if (straight) {
      const edge = (x: number, ...ends: number[]): number[][] => ends.map((z) => [x, 0, z + d]);
      parts = cuts.slice(1).map((b, k) => ribbon(edge(0.9 * size, cuts[k], b), edge((0.9 + WIDE) * size, cuts[k], b)));
    } else {
      height = this.top(i, size) + ABOVE;
      const least = size / (1 + (WINDS * (upper - lower)) / Math.PI);
      parts = cuts.slice(1).map((b, k) => sector(cuts[k], b, lower, least, height).rotateZ(theta));
    }
    const [first, free, last] = parts;
    const hand = new THREE.Mesh(straight ? needle(0.3 * size, 0.9 * size) : needle(0.35 * size, size), flat("#fff"));
    const nodes = [new THREE.Mesh(free, this.free), new THREE.Mesh(mergeGeometries([first, last]), flat(END)), hand];
    this.figure.links[i].add(...nodes);
    this.root.push(...nodes);
    return { hand, tip: (straight ? 1.4 : 1.2) * size, height: height + (straight ? 0 : ABOVE) };
  }

  /** Returns the height of a link's bodies near the axis of its joint, in the frame before it [m]. */
  private top(i: number, radius: number): number {
    const joint = this.bodies.model.joints[i];
    const matrix = matrixOf(linkAfter(identity(), joint, 0));
    const point = new THREE.Vector3();
    let top = -Infinity;
    for (const body of this.bodies.all) {
      if (body.link !== i + 1) continue;
      const points = body.geometry.getAttribute("position");
      for (let k = 0; k < points.count; k++) {
        point.fromBufferAttribute(points, k).applyMatrix4(matrix);
        if (Math.hypot(point.x, point.y) < radius) top = Math.max(top, point.z);
      }
    }
    return top === -Infinity ? joint.d : Math.max(top, 0);
  }

  show({ q, frames, T_world_robot }: InWorld): void {
    if (!this.on) return;
    const { free, hand: dark } = this.stage.colours;
    this.free.color.set(free);
    this.scales.forEach(({ hand, tip, height }, i) => {
      const joint = this.bodies.model.joints[i];
      const { lower, upper, theta = 0 } = joint;
      const straight = slides(joint);
      const T = rotation(Z, theta + (straight ? 0 : q[i]));
      T[11] = height + (straight ? q[i] : 0);
      setPose(hand, T);
      hand.material.color.set(Math.min(q[i] - lower, upper - q[i]) < NEAR * (upper - lower) ? END : dark);
      const at = movePoint(multiply(multiply(T_world_robot, frames[i]), T), [tip, 0, 0]);
      const value = Math.round((straight ? 1000 : DEGREES) * q[i]) + 0; // never -0
      this.stage.labels.set(`joint ${i}`, "joint", `JT${i + 1}  ${value}${straight ? " mm" : "°"}`, at);
    });
  }
}

const STEPS = 60; // corners of a full circle about the first axis
const AGAIN = 2000; // [ms] minimum time between two requests for the boundary

/** The boundary of the reach in the current configuration, for an arm that turns about its first axis. The robot computes it. */
export class ReachView {
  private on = false;
  private readonly mesh = new THREE.Mesh(new THREE.BufferGeometry(), flat("#fff", { transparent: true, opacity: 0.16, depthWrite: false }));
  private readonly asked = new Change(AGAIN);
  private readonly drawn = new Change();

  constructor(private readonly stage: Stage, figure: Figure, private readonly connection: Connection) {
    this.mesh.renderOrder = 3;
    this.mesh.visible = false;
    figure.links[0].add(this.mesh);
    stage.onPaint.add((colours) => this.mesh.material.color.set(colours.reach));
    this.mesh.material.color.set(stage.colours.reach);
  }

  set visible(on: boolean) {
    this.on = on;
    this.mesh.visible = on;
    this.asked.forget();
  }

  show({ timeline }: InWorld): void {
    if (!this.on || !this.asked.to(`${timeline.version}`)) return;
    void this.connection.ask("at", { act: { kind: "Boundary" } }).then(({ found }) => {
      if (found?.kind === "BoundaryCurves" && this.drawn.to(found)) this.draw(found.lines, found.turns);
    });
  }

  /** Turns lines (distance, height, angle) about the first axis. */
  private draw(lines: number[][][], [first, last]: [number, number]): void {
    const span = Math.min(last - first, 2 * Math.PI);
    const count = Math.max(2, Math.round((STEPS * span) / (2 * Math.PI)) + 1);
    const positions: number[] = [], index: number[] = [];
    for (const line of lines) {
      const start = positions.length / 3;
      for (const [r, z, angle] of line)
        for (let k = 0; k < count; k++) {
          const w = angle + first + (span * k) / (count - 1);
          positions.push(r * Math.cos(w), r * Math.sin(w), z);
        }
      for (let i = 0; i + 1 < line.length; i++)
        for (let k = 0; k + 1 < count; k++) {
          const a = start + i * count + k;
          index.push(a, a + 1, a + count + 1, a, a + count + 1, a + count);
        }
    }
    this.mesh.geometry.dispose();
    this.mesh.geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(positions, 3)).setIndex(index);
    this.stage.change();
  }
}
