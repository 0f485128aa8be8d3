/** Three-vectors and the camera's frame: the linear algebra that the page needs. */
import type { Camera, Vec3 } from "./data";

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const normalize = (a: Vec3): Vec3 => scale(a, 1 / (length(a) || 1));

/** The sphere's dp/du with its axis along +y; x at the poles, where it is undefined. */
export function sphereTangent(normal: Vec3): Vec3 {
  const l = Math.hypot(normal[0], normal[2]);
  return l > 1e-9 ? [normal[2] / l, 0, -normal[0] / l] : [1, 0, 0];
}

export interface Frame {
  eye: Vec3;
  right: Vec3;
  up: Vec3;
  /** Away from the target: the camera looks along -back. */
  back: Vec3;
  /** Tangent of half the vertical field of view. */
  half: number;
}

export function cameraFrame(camera: Camera): Frame {
  const { azimuth, elevation } = camera;
  const back: Vec3 = [
    Math.sin(azimuth) * Math.cos(elevation),
    Math.sin(elevation),
    Math.cos(azimuth) * Math.cos(elevation),
  ];
  const right: Vec3 = [Math.cos(azimuth), 0, -Math.sin(azimuth)];
  return {
    eye: add(camera.target, scale(back, camera.distance)),
    right,
    up: cross(back, right),
    back,
    half: Math.tan((camera.fov * Math.PI) / 360),
  };
}

/**
 * Tangent of half the vertical field of view in a picture of this shape. Scenes are framed for 16 : 9; a narrower
 * picture has the same horizontal extent, so that no ball is cut off on a phone.
 */
export const fitted = (half: number, aspect: number): number => half * Math.max(1, 16 / 9 / aspect);

/** A world point in the camera's frame: x right, y up, z toward the viewer. */
export function toView(frame: Frame, point: Vec3): Vec3 {
  const d = sub(point, frame.eye);
  return [dot(d, frame.right), dot(d, frame.up), dot(d, frame.back)];
}

/** Pixel (from the top left) of a world point, or null behind the camera. */
export function toPixel(frame: Frame, point: Vec3, width: number, height: number): [number, number] | null {
  const [x, y, z] = toView(frame, point);
  if (z > -1e-6) return null;
  const focal = height / 2 / fitted(frame.half, width / height);
  return [width / 2 + (x / -z) * focal, height / 2 - (y / -z) * focal];
}

/** Unit direction of the ray through a pixel position. */
export function pixelRay(frame: Frame, x: number, y: number, width: number, height: number): Vec3 {
  const half = fitted(frame.half, width / height);
  const px = ((2 * x - width) / height) * half;
  const py = ((height - 2 * y) / height) * half;
  return normalize(add(add(scale(frame.right, px), scale(frame.up, py)), scale(frame.back, -1)));
}

/**
 * Bounds of a sphere in the picture, in normalized device coordinates [x0, y0, x1, y1]; null if it is behind the camera.
 * Exact: the tangent planes through the eye that contain an axis of the picture.
 */
export function sphereBounds(frame: Frame, center: Vec3, radius: number, aspect: number): [number, number, number, number] | null {
  const [x, y, z] = toView(frame, center);
  if (z - radius > -1e-3) return null;
  const extent = (offset: number, edge: number): [number, number] => {
    const across = Math.atan2(offset, -z);
    const spread = Math.asin(Math.min(1, radius / Math.hypot(offset, z)));
    const limit = Math.PI / 2 - 1e-3;
    return [Math.tan(Math.max(across - spread, -limit)) / edge, Math.tan(Math.min(across + spread, limit)) / edge];
  };
  const half = fitted(frame.half, aspect);
  const [x0, x1] = extent(x, half * aspect);
  const [y0, y1] = extent(y, half);
  return x0 > 1 || x1 < -1 || y0 > 1 || y1 < -1 ? null : [Math.max(x0, -1), Math.max(y0, -1), Math.min(x1, 1), Math.min(y1, 1)];
}
