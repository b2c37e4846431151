import * as THREE from "three";
import type { Point } from "../core/transform";

/** Lines that are a few pixels wide, and change colour at a time: each piece has the time at its ends, and two colours. */
const VERTEX = /* glsl */ `
  attribute vec4 begin;
  attribute vec4 finish;
  attribute vec3 early;
  attribute vec3 late;
  uniform float width;
  uniform vec2 resolution;
  varying float vTime;
  varying vec3 vEarly;
  varying vec3 vLate;
  void main() {
    vec4 a = modelViewMatrix * vec4(begin.xyz, 1.0);
    vec4 b = modelViewMatrix * vec4(finish.xyz, 1.0);
    float near = -0.001; // what is behind the camera is cut off
    if (a.z > near && b.z <= near) a = mix(b, a, (near - b.z) / (a.z - b.z));
    else if (b.z > near && a.z <= near) b = mix(a, b, (near - a.z) / (b.z - a.z));
    vec4 p = projectionMatrix * a;
    vec4 q = projectionMatrix * b;
    vec2 along = (q.xy / q.w - p.xy / p.w) * resolution;
    float length = length(along);
    along = length > 0.0 ? along / length : vec2(1.0, 0.0);
    vec4 at = position.y < 0.5 ? p : q;
    vec2 offset = position.x * vec2(-along.y, along.x) + (position.y < 0.5 ? -1.0 : 1.0) * 0.6 * along; // joints are closed
    at.xy += offset * width / resolution * at.w;
    gl_Position = at;
    vTime = position.y < 0.5 ? begin.w : finish.w;
    vEarly = early;
    vLate = late;
  }`;
const FRAGMENT = /* glsl */ `
  uniform float now;
  varying float vTime;
  varying vec3 vEarly;
  varying vec3 vLate;
  void main() {
    gl_FragColor = vec4(vTime < now ? vEarly : vLate, 1.0);
    #include <colorspace_fragment>
  }`;
const DOT_VERTEX = /* glsl */ `
  uniform float size;
  void main() {
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    gl_Position.z -= 0.0005 * gl_Position.w; // before the line on which it lies
    gl_PointSize = size;
  }`;
const DOT_FRAGMENT = /* glsl */ `
  uniform vec3 colour;
  void main() {
    vec2 off = gl_PointCoord - 0.5;
    if (dot(off, off) > 0.25) discard;
    gl_FragColor = vec4(colour, 1.0);
    #include <colorspace_fragment>
  }`;
const QUAD = { corners: [-1, 0, 0, 1, 0, 0, 1, 1, 0, -1, 1, 0], index: [0, 1, 2, 0, 2, 3] };

/** A piece of a line: two points in the world [m] with the times there [s], and its colours before and after `now`. */
export interface Piece {
  a: Point;
  b: Point;
  from: number;
  to: number;
  early: THREE.Color;
  late: THREE.Color;
}

/** Many pieces of lines, drawn at once. */
export class Lines {
  readonly mesh: THREE.Mesh<THREE.InstancedBufferGeometry, THREE.ShaderMaterial>;
  private readonly uniforms = { width: { value: 0 }, resolution: { value: new THREE.Vector2(1, 1) }, now: { value: 0 } };
  private origin = 0; // [s] times are stored from here on, so that they keep their precision

  /** `width`: of the lines [px]. */
  constructor(private readonly width: number) {
    const material = new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: this.uniforms, side: THREE.DoubleSide });
    this.mesh = new THREE.Mesh(new THREE.InstancedBufferGeometry(), material);
    this.mesh.frustumCulled = false;
    this.mesh.onBeforeRender = (renderer) => {
      renderer.getDrawingBufferSize(this.uniforms.resolution.value);
      this.uniforms.width.value = this.width * renderer.getPixelRatio();
    };
    this.set([]);
  }

  set(pieces: Piece[]): void {
    this.mesh.geometry.dispose();
    const made = new THREE.InstancedBufferGeometry();
    made.setAttribute("position", new THREE.Float32BufferAttribute(QUAD.corners, 3)).setIndex(QUAD.index);
    this.origin = pieces.length ? pieces[0].from : 0;
    const add = (name: string, size: number, of: (piece: Piece) => Iterable<number>): void => {
      const data = new Float32Array(size * pieces.length);
      pieces.forEach((piece, i) => data.set([...of(piece)], size * i));
      made.setAttribute(name, new THREE.InstancedBufferAttribute(data, size));
    };
    add("begin", 4, ({ a, from }) => [...a, from - this.origin]);
    add("finish", 4, ({ b, to }) => [...b, to - this.origin]);
    add("early", 3, ({ early }) => early);
    add("late", 3, ({ late }) => late);
    made.instanceCount = pieces.length;
    this.mesh.geometry = made;
    this.mesh.visible = pieces.length > 0;
  }

  /** Sets the time at which the colours change. */
  set now(t: number) {
    this.uniforms.now.value = t - this.origin;
  }
}

/** Round dots of a size in pixels. */
export class Dots {
  readonly points: THREE.Points<THREE.BufferGeometry, THREE.ShaderMaterial>;

  constructor(size: number) {
    const uniforms = { size: { value: size }, colour: { value: new THREE.Color() } };
    this.points = new THREE.Points(new THREE.BufferGeometry(), new THREE.ShaderMaterial({ vertexShader: DOT_VERTEX, fragmentShader: DOT_FRAGMENT, uniforms }));
    this.points.frustumCulled = false;
    this.points.onBeforeRender = (renderer) => {
      uniforms.size.value = size * renderer.getPixelRatio();
    };
  }

  set(places: Point[], colour: string): void {
    this.points.geometry.dispose();
    this.points.geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.Float32BufferAttribute(places.flat(), 3));
    this.points.material.uniforms.colour.value.set(colour);
    this.points.visible = places.length > 0;
  }
}
