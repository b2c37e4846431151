import * as THREE from "three";
import { ConvexGeometry } from "three/examples/jsm/geometries/ConvexGeometry.js";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { Change } from "../core/change";
import { multiply, originOf } from "../core/transform";
import type { World } from "../core/world";
import { RED, setPose, type Figure } from "./figure";
import type { InWorld } from "./scene";
import { geometry } from "./shapes";
import type { Stage } from "./stage";

const LASTING = 0.1; // [s] minimum duration of red paint, so that short contacts are visible
const THIN = 0.003; // [m] minimum displayed radius of a beam
const LIT = new THREE.Color("#ffc400");
const DARK = new THREE.Color("#607080");

type Shape = { type: string; size?: number[]; radius?: number; height?: number; pieces?: number[][][] };
type Zone = { size: number[]; T_world_zone: number[] };
interface Body { name: string; shape: Shape; colour: number[]; T_world_part?: number[]; T_world_fixture?: number[] }
interface Region extends Partial<Zone> { type: string; begin?: number[]; end?: number[]; place?: number[]; direction?: number[]; range?: number; radius?: number }

/** The cell around a robot: `cell.scene` of the welcome. */
export interface CellScene {
  parts?: Body[];
  fixtures?: Body[];
  sensors?: { name: string; signal: number; region: Region }[];
  feeders?: { parts: string[]; T_world_part?: number[] | null }[];
  sinks?: { zone: Zone }[];
  floor?: number | null;
}

/** Returns the surface of a part or a fixture, in its own frame. */
export function surfaceOf({ type, size, radius = 0, height = 0, pieces = [] }: Shape): THREE.BufferGeometry {
  if (type === "BoxShape") return geometry({ link: 0, kind: "box", size });
  if (type === "CylinderShape") return geometry({ link: 0, kind: "cylinder", from: [0, 0, -height / 2], to: [0, 0, height / 2], radius });
  if (type === "SphereShape") return new THREE.SphereGeometry(radius, 40, 20);
  return mergeGeometries(pieces.map((points) => new ConvexGeometry(points.map((p) => new THREE.Vector3(p[0], p[1], p[2])))));
}

/** Returns the surface of a sensor's region; a thin beam is drawn thicker. */
function regionOf({ type, size, begin, end, place, direction, range = 0, radius = 0 }: Region): THREE.BufferGeometry {
  if (type === "Zone") return new THREE.BoxGeometry(...(size as [number, number, number]));
  const [from, to] = type === "Beam" ? [begin!, end!] : [place!, place!.map((x, i) => x + range * direction![i])];
  return geometry({ link: 0, kind: "capsule", from, to, radius: Math.max(radius, THIN) });
}

interface Drawn { mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshLambertMaterial>; own: THREE.Color }

/** The cell: parts, fixtures, sensors that light up, feeders and sinks. Touching bodies are red. */
export class PartsView {
  readonly root = new THREE.Group();
  /** Whether parts have labels. */
  named = true;
  private readonly bodies = new Map<string, Drawn>();
  private readonly sensors: Drawn["mesh"][] = [];
  private readonly parts: string[];
  private red = new Set<string>();
  private readonly drawn = new Change();

  constructor(private readonly stage: Stage, private readonly figure: Figure, private readonly world: World, scene: CellScene) {
    const { parts = [], fixtures = [], sensors = [], feeders = [], sinks = [] } = scene;
    this.parts = parts.map((part) => part.name);
    for (const one of [...fixtures, ...parts]) {
      const own = new THREE.Color().setRGB(one.colour[0], one.colour[1], one.colour[2], THREE.SRGBColorSpace);
      const mesh = new THREE.Mesh(surfaceOf(one.shape), new THREE.MeshLambertMaterial({ color: own }));
      mesh.castShadow = mesh.receiveShadow = true;
      setPose(mesh, Float64Array.from(one.T_world_fixture ?? one.T_world_part!));
      mesh.visible = !!one.T_world_fixture;
      this.bodies.set(one.name, { mesh, own });
      this.root.add(mesh);
    }
    for (const { region } of sensors) {
      const mesh = new THREE.Mesh(regionOf(region), new THREE.MeshLambertMaterial({ color: DARK, transparent: true, opacity: 0.25, depthWrite: false }));
      if (region.T_world_zone) setPose(mesh, Float64Array.from(region.T_world_zone));
      mesh.renderOrder = 2;
      this.sensors.push(mesh);
      this.root.add(mesh);
    }
    for (const { parts: [first], T_world_part } of feeders) {
      const part = parts.find(({ name }) => name === first);
      if (part) this.outline(surfaceOf(part.shape), T_world_part ?? part.T_world_part!, stage.colours.free);
    }
    for (const { zone } of sinks) this.outline(new THREE.BoxGeometry(...(zone.size as [number, number, number])), zone.T_world_zone, stage.colours.stop);
  }

  /** Draws the edges of a feeder or a sink. */
  private outline(surface: THREE.BufferGeometry, T: number[], colour: string): void {
    const lines = new THREE.LineSegments(new THREE.EdgesGeometry(surface, 30), new THREE.LineBasicMaterial({ color: colour, transparent: true, opacity: 0.7 }));
    setPose(lines, Float64Array.from(T));
    this.root.add(lines);
  }

  set visible(on: boolean) {
    this.root.visible = on;
    this.drawn.forget();
    if (!on) this.stage.labels.remove("part ");
  }

  show({ t, frames, T_world_robot }: InWorld): void {
    if (!this.root.visible) return;
    const { world } = this;
    const T_world_flange = multiply(T_world_robot, frames[frames.length - 1]);
    const poses = this.parts.map((name) => world.pose(name, t, T_world_flange));
    const lit = this.sensors.map((_, k) => world.sees(k, t));
    const touching = world.touching(t, LASTING).flat();
    if (!this.drawn.to(`${poses} ${lit} ${touching} ${this.named}`)) return;
    this.parts.forEach((name, i) => {
      const { mesh } = this.bodies.get(name)!;
      const T = poses[i];
      mesh.visible = !!T;
      if (T) setPose(mesh, T);
      if (T && this.named) this.stage.labels.set(`part ${name}`, "part", name, originOf(T));
      else this.stage.labels.remove(`part ${name}`, true);
    });
    this.sensors.forEach(({ material }, k) => {
      material.color.copy(lit[k] ? LIT : DARK);
      material.opacity = lit[k] ? 0.75 : 0.25;
    });
    this.paint(new Set(touching));
    this.stage.change(true);
  }

  /** Paints touching bodies red, and others in their own colours. */
  private paint(red: Set<string>): void {
    for (const name of new Set([...red, ...this.red])) {
      if (red.has(name) === this.red.has(name)) continue;
      const body = this.bodies.get(name);
      const last = this.figure.links.length - 1;
      const link = name === "base" ? 0 : name === "hand" ? last : Number(/^link (\d+)$/.exec(name)?.[1] ?? -1);
      if (body) body.mesh.material.color.copy(red.has(name) ? RED.color : body.own);
      else if (link >= 0) this.figure.paint(link, red.has(name) ? RED : null);
    }
    this.red = red;
  }

  /** Describes the parts at t for screen readers. */
  told(t: number): string[] {
    const { world } = this;
    const held = world.held(t);
    const places = this.parts.flatMap((name) => {
      if (name === held) return [`the hand holds ${name}`];
      if (!this.bodies.get(name)!.mesh.visible) return [`${name} is not there`];
      const on = world.supports(name, t);
      return on.length ? [`${name} stands on ${on.join(" and ")}`] : [`${name} stands`];
    });
    return [...places, ...world.touching(t).map(([a, b]) => `${a} touches ${b}`)];
  }
}
