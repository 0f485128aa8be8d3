/** Directions on the sphere, local frame (+z the normal), and the half and difference angles. Radians. */
import type { Vec3 } from "../data";
import { cross, dot, normalize } from "../vectors";

export const RADIANS = Math.PI / 180;

export function polar(theta: number, phi: number): Vec3 {
  const s = Math.sin(theta);
  return [s * Math.cos(phi), s * Math.sin(phi), Math.cos(theta)];
}

export const thetaOf = (w: Vec3) => Math.atan2(Math.hypot(w[0], w[1]), w[2]);
/** Azimuth; 0 for the normal, whose azimuth is undefined. */
export const phiOf = (w: Vec3) => (w[0] === 0 && w[1] === 0 ? 0 : Math.atan2(w[1], w[0]));

/** Two unit vectors that complete `axis` to a right-handed frame. */
export function frameAround(axis: Vec3): [Vec3, Vec3] {
  const helper: Vec3 = Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
  const x = normalize(cross(helper, axis));
  return [x, cross(axis, x)];
}

/**
 * wo and wi of the half and difference angles [Rusinkiewicz 1998]: h at (thetaH, phiH); relative to h, wi at
 * (thetaD, phiD); wo is wi mirrored at h. At phiD = 90 and thetaD = 45 degrees both are outside the plane of h and n.
 */
export function fromHalf(thetaH: number, thetaD: number, phiD: number, phiH = 0): { wo: Vec3; wi: Vec3 } {
  const h = polar(thetaH, phiH);
  const d = polar(thetaD, phiD);
  const [c, s] = [Math.cos(thetaH), Math.sin(thetaH)];
  // About y by thetaH, then about z by phiH.
  const [x, y, z]: Vec3 = [c * d[0] + s * d[2], d[1], -s * d[0] + c * d[2]];
  const wi: Vec3 = [Math.cos(phiH) * x - Math.sin(phiH) * y, Math.sin(phiH) * x + Math.cos(phiH) * y, z];
  const twice = 2 * dot(h, wi);
  return { wo: [twice * h[0] - wi[0], twice * h[1] - wi[1], twice * h[2] - wi[2]], wi };
}
