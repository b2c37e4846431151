import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { mergeGeometries, mergeVertices } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { slides, type Model, type Shape } from "../core/kinematics";
import { column, identity, movedTo, movePoint, multiply, originOf, rotation, transformOf, type Transform } from "../core/transform";
import { shapeColour } from "./colours";
import { geometry } from "./shapes";

/** Returns a transformation as a matrix of three.js. */
export const matrixOf = (T: ArrayLike<number>): THREE.Matrix4 =>
  new THREE.Matrix4(T[0], T[1], T[2], T[3], T[4], T[5], T[6], T[7], T[8], T[9], T[10], T[11], 0, 0, 0, 1);

/** Sets the pose of an object that nothing else moves. */
export function setPose(object: THREE.Object3D, T: Transform): void {
  object.matrixAutoUpdate = false;
  object.matrix.copy(matrixOf(T));
  object.matrixWorldNeedsUpdate = true;
}

/** How a part of the hand moves from closed to open: it slides, and turns about a line through `point` [rad], as far as these vectors are long. */
export interface Opening {
  slide?: number[];
  turn?: number[];
  point?: number[];
}

/** Returns how far a part of the hand has moved, in the frame of its link. `hand`: 1 open, 0 closed. */
export function opened(openings: Opening[], hand: number): Transform {
  let T = identity();
  for (const { slide = [0, 0, 0], turn = [0, 0, 0], point = [0, 0, 0] } of openings) {
    const angle = Math.hypot(...turn);
    const R = angle ? rotation(turn.map((x) => x / angle), angle * hand) : identity();
    const turned = movePoint(R, point);
    T = multiply(multiply(T, movedTo(slide.map((x, i) => x * hand + point[i] - turned[i]))), R);
  }
  return T;
}

const openings = (shape: Shape): Opening[] => {
  const opens = shape.opens as number[] | Opening[] | undefined;
  if (!opens?.length) return [];
  return typeof opens[0] === "number" ? [{ slide: opens as number[] }] : (opens as Opening[]);
};

/** A surface of a link in one piece, in the colours of its vertices. */
export interface Body {
  link: number;
  geometry: THREE.BufferGeometry;
  opens: Opening[];
  /** Whether both sides are drawn, because surfaces of files may have holes. */
  holes: boolean;
  /** The material of a mesh file with textures. */
  material?: THREE.Material;
}

/** Returns a geometry that can be merged with others; vertices without colours get one colour. */
export function plain(from: THREE.BufferGeometry, colour: THREE.Color): THREE.BufferGeometry {
  const made = new THREE.BufferGeometry();
  for (const name of ["position", "normal"]) made.setAttribute(name, from.getAttribute(name));
  made.setIndex(from.index);
  const { count } = made.getAttribute("position");
  const colours = new Float32Array(3 * count);
  const own = from.getAttribute("color");
  for (let i = 0; i < count; i++) (own ? new THREE.Color().fromBufferAttribute(own, i) : colour).toArray(colours, 3 * i);
  made.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  return made.index ? made : mergeVertices(made);
}

/** The surfaces of a robot, shared by all its figures: one for each link and each part of the hand. */
export class Bodies {
  readonly all: Body[] = [];
  /** Callbacks for bodies that arrive later, from mesh files. */
  readonly onMore = new Set<(bodies: Body[]) => void>();
  /** Number of meshes that could not be loaded. */
  missing = 0;
  /** Resolves when all meshes are loaded or known to be missing. */
  readonly ready: Promise<void>;

  constructor(readonly model: Model) {
    const groups = new Map<string, Shape[]>();
    for (const shape of model.shapes ?? []) {
      const key = `${shape.link} ${shape.kind === "mesh"} ${JSON.stringify(shape.opens ?? null)}`;
      groups.set(key, [...(groups.get(key) ?? []), shape]);
    }
    const meshes: Shape[][] = [];
    for (const shapes of groups.values()) {
      if (shapes[0].kind === "mesh") meshes.push(shapes);
      else this.all.push(body(shapes[0], shapes.map((shape) => plain(geometry(shape), shapeColour(shape.colour)))));
    }
    this.ready = Promise.all(meshes.map((shapes) => this.load(shapes))).then(() => {});
  }

  private async load(shapes: Shape[]): Promise<void> {
    const loader = new GLTFLoader();
    const parts: THREE.BufferGeometry[] = [];
    const found: Body[] = [];
    const take = async (shape: Shape): Promise<void> => {
      const { scene } = await loaded(loader, shape.glb!);
      if (shape.at) setPose(scene, shape.at.length === 12 ? transformOf(shape.at) : movedTo(shape.at));
      scene.updateMatrixWorld(true);
      scene.traverse((node) => {
        if (!(node instanceof THREE.Mesh)) return;
        const surface = (node.geometry as THREE.BufferGeometry).clone().applyMatrix4(node.matrixWorld);
        if (!surface.getAttribute("normal")) surface.computeVertexNormals();
        const material = node.material as THREE.MeshStandardMaterial;
        if (material.map) {
          const textured = new THREE.MeshLambertMaterial({ map: material.map, color: material.color, side: THREE.DoubleSide });
          found.push({ link: shape.link, geometry: surface, opens: openings(shape), holes: true, material: textured });
        } else parts.push(plain(surface, material.color));
      });
    };
    await Promise.all(shapes.map((shape) => take(shape).catch(() => void this.missing++)));
    if (parts.length) found.push({ ...body(shapes[0], parts), holes: true });
    this.all.push(...found);
    for (const more of this.onMore) more(found);
  }
}

/** Loads a mesh from its address. A mesh inside a data address needs no request, which the page's policy may forbid. */
function loaded(loader: GLTFLoader, address: string): ReturnType<GLTFLoader["loadAsync"]> {
  const [, data] = address.split(";base64,");
  return data === undefined ? loader.loadAsync(address) : loader.parseAsync(Uint8Array.from(atob(data), (c) => c.charCodeAt(0)).buffer, "");
}

const body = (first: Shape, parts: THREE.BufferGeometry[]): Body => ({ link: first.link, geometry: mergeGeometries(parts), opens: openings(first), holes: false });

/** The style of a ghost: its material, its place in the order of drawing, and optionally another surface for each body. */
export interface Look {
  material: THREE.Material;
  order: number;
  surface?(of: THREE.BufferGeometry): THREE.BufferGeometry;
}

const OWN = new THREE.MeshLambertMaterial({ vertexColors: true });
const OWN_HOLES = new THREE.MeshLambertMaterial({ vertexColors: true, side: THREE.DoubleSide });
/** Paints of links: of a robot without messages, and of touching bodies. */
export const [GREY, RED] = ["#9aa0a6", "#d63031"].map((color) => new THREE.MeshLambertMaterial({ color, side: THREE.DoubleSide }));

/** An arm: a node for each link, with its surfaces. Its root stands at T_world_robot. */
export class Figure {
  readonly root = new THREE.Group();
  /** Frames of the base and of all links, which can hold other objects. */
  readonly links: THREE.Group[] = [];
  private readonly meshes: { body: Body; mesh: THREE.Mesh }[] = [];
  private readonly paints = new Map<number, THREE.Material>();
  private hand = -1;

  /** `look`: of a ghost; without it each shape has its own colour. */
  constructor(readonly bodies: Bodies, private readonly look?: Look) {
    for (let i = 0; i <= bodies.model.joints.length; i++) {
      const link = new THREE.Group();
      link.matrixAutoUpdate = false;
      this.links.push(link);
      this.root.add(link);
    }
    this.add(bodies.all);
    bodies.onMore.add((more) => this.add(more));
  }

  private add(bodies: Body[]): void {
    for (const body of bodies) {
      const mesh = new THREE.Mesh(this.look?.surface?.(body.geometry) ?? body.geometry, this.material(body));
      mesh.castShadow = !this.look;
      mesh.renderOrder = this.look?.order ?? 0;
      mesh.matrixAutoUpdate = false;
      if (body.opens.length && this.hand >= 0) setPose(mesh, opened(body.opens, this.hand));
      this.meshes.push({ body, mesh });
      this.links[body.link]?.add(mesh);
    }
  }

  private material(body: Body): THREE.Material {
    return this.look?.material ?? this.paints.get(body.link) ?? body.material ?? (body.holes ? OWN_HOLES : OWN);
  }

  /** Sets the frames (T_robot_link) and the hand, from 0 (closed) to 1 (open); `T`: T_world_robot. */
  pose(frames: Transform[], hand: number, T: Transform): void {
    setPose(this.root, T);
    frames.forEach((frame, i) => setPose(this.links[i], frame));
    if (hand === this.hand) return;
    this.hand = hand;
    for (const { body, mesh } of this.meshes) if (body.opens.length) setPose(mesh, opened(body.opens, hand));
  }

  /** Shows or hides the surfaces of one link only. */
  showLink(link: number, on: boolean): void {
    for (const { body, mesh } of this.meshes) if (body.link === link) mesh.visible = on;
  }

  /** Paints a link (0: the base); null: in its own colours. */
  paint(link: number, paint: THREE.Material | null): void {
    if (paint) this.paints.set(link, paint);
    else this.paints.delete(link);
    for (const { body, mesh } of this.meshes) if (body.link === link) mesh.material = this.material(body);
  }
}

/** Returns the smallest box around bodies at some postures of the robot (T_robot_link), in the robot's frame [m]. */
export function roomOf(bodies: Body[], postures: Transform[][]): THREE.Box3 {
  const room = new THREE.Box3();
  for (const frames of postures)
    for (const { link, geometry } of bodies) {
      const positions = geometry.getAttribute("position").clone().applyMatrix4(matrixOf(frames[link]));
      room.union(new THREE.Box3().setFromBufferAttribute(positions as THREE.BufferAttribute));
    }
  return room;
}

/** Returns the maximum distance of the tool from the first axis [m], the scale of drawings. */
export function reachOf({ joints }: Model, zero: Transform[]): number {
  let at = originOf(zero[zero.length - 1]);
  let far = 0;
  for (let i = joints.length; i-- > 0; ) {
    const { lower, upper } = joints[i];
    const [z, p] = [column(zero[i], 2), originOf(zero[i])];
    const along = z.reduce((sum, zk, k) => sum + zk * (at[k] - p[k]), 0);
    const foot = p.map((pk, k) => pk + along * z[k]) as typeof p;
    far += Math.hypot(...foot.map((x, k) => x - at[k])) + (slides(joints[i]) ? Math.max(Math.abs(lower), Math.abs(upper)) : 0);
    at = foot;
  }
  return Math.max(far, 0.05);
}
