import * as THREE from "three";
import { frames, slides } from "../core/kinematics";
import { roomOf, type Bodies } from "./figure";

const FIELD = 0.66; // [rad] vertical field of view, that of a 50 mm lens
/** The direction from the robot to the viewer: in front, to its left, above. */
export const HOME = new THREE.Vector3(0.8, 0.55, 0.38);
/** Directions of the camera. The small Y puts X to the right in the view from above. */
export const DIRECTIONS = {
  front: new THREE.Vector3(1, 0, 0),
  side: new THREE.Vector3(0, -1, 0),
  top: new THREE.Vector3(0, -1e-4, 1),
};

export const makeCamera = (): THREE.PerspectiveCamera => new THREE.PerspectiveCamera(THREE.MathUtils.radToDeg(FIELD), 1, 0.01, 100);

/** Places a camera so that it sees a whole ball from a direction; `margin`: the visible room in balls. */
export function placeCamera(camera: THREE.PerspectiveCamera, ball: THREE.Sphere, towards: THREE.Vector3, margin = 1): void {
  const half = Math.atan(Math.tan(FIELD / 2) * Math.min(1, camera.aspect));
  camera.position.copy(ball.center).addScaledVector(towards.clone().normalize(), (margin * ball.radius) / Math.sin(half));
}

/** Returns a ball around the arm at READY, at NEST, and with sliding joints far out, in the robot's frame [m]. */
export function homeBall({ model, all }: Bodies): THREE.Sphere {
  const ready = model.poses.ready ?? model.joints.map(() => 0);
  const far = ready.map((x, i) => (slides(model.joints[i]) ? model.joints[i].upper : x));
  const room = roomOf(all, [ready, model.poses.nest ?? ready, far].map((q) => frames(model, q)));
  return room.isEmpty() ? new THREE.Sphere(new THREE.Vector3(), 1) : room.getBoundingSphere(new THREE.Sphere());
}
