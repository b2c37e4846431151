import * as THREE from "three";
import { frames, type Model } from "../core/kinematics";
import { roomOf, type Bodies } from "./figure";

/** From the robot to who looks at it: from the front, on its left, from above. */
export const HOME = new THREE.Vector3(0.8, 0.55, 0.38);
/** Directions from which the camera looks. The little Y has X to the right in a picture from above. */
export const DIRECTIONS = {
  front: new THREE.Vector3(1, 0, 0),
  side: new THREE.Vector3(0, -1, 0),
  top: new THREE.Vector3(0, -1e-4, 1),
};

/** Returns a ball around the arm at READY, at NEST, and with sliding joints far out, in the robot's frame [m]. */
export function homeBall(model: Model, bodies: Bodies): THREE.Sphere {
  const zero = model.joints.map(() => 0);
  const ready = model.poses.ready ?? zero;
  const far = ready.map((x, i) => (model.joints[i].kind === "prismatic" ? model.joints[i].upper : x));
  const room = roomOf(bodies, [ready, model.poses.nest ?? ready, far].map((q) => frames(model, q)));
  return room.isEmpty() ? new THREE.Sphere(new THREE.Vector3(), 1) : room.getBoundingSphere(new THREE.Sphere());
}
