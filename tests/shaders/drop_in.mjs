// A tilted plane of an emitted material in three.js, drawn into linear floats: what test_npm_packages.py compares.
import * as THREE from "three";
import { load, material, patch, set } from "gonio-three";

const SIDE = 128;
let renderer;

const lamps = {
  directional: () => new THREE.DirectionalLight(new THREE.Color(1.0, 0.8, 0.6), 3.0),
  point: () => new THREE.PointLight(new THREE.Color(1.0, 0.8, 0.6), 40.0),
  spot: () => new THREE.SpotLight(new THREE.Color(1.0, 0.8, 0.6), 40.0, 0, 1.2, 1.0),
  none: () => new THREE.Object3D(),
};

/** The rows of RGBA from the bottom, as an array of numbers. */
export async function draw({ how, url, model, lamp, values, later, options, physical, sky, blocked }) {
  renderer ??= new THREE.WebGLRenderer();
  renderer.shadowMap.enabled = Boolean(blocked);
  const three = () => new THREE.MeshPhysicalMaterial({ metalness: 1, roughness: 0.4, ...physical });
  const bundle = how === "three" ? null : await load(url, model);
  const patched = () => patch(three(), bundle, values, options);
  const made = { three, material: () => material(bundle, values, options), patch: patched }[how]();
  const scene = new THREE.Scene();
  const plane = new THREE.Mesh(new THREE.PlaneGeometry(12, 12), made);
  if (options?.tangents) plane.geometry.computeTangents();
  plane.rotation.set(-0.5, 0.3, 0.2);
  plane.receiveShadow = true;
  const light = lamps[lamp]();
  light.position.set(1, 2, 3);
  light.castShadow = Boolean(blocked);
  scene.add(plane, light);
  if (light.target) scene.add(light.target);
  if (blocked) {
    const unseen = new THREE.MeshBasicMaterial({ side: THREE.DoubleSide, colorWrite: false, depthWrite: false });
    const block = new THREE.Mesh(new THREE.PlaneGeometry(0.6, 0.6), unseen);
    block.position.set(0.5, 1, 1.5);
    block.lookAt(1, 2, 3);
    block.castShadow = true;
    scene.add(block);
  }
  if (sky) {
    const even = new THREE.DataTexture(new Float32Array([0.5, 0.7, 1, 1]), 1, 1, THREE.RGBAFormat, THREE.FloatType);
    even.mapping = THREE.EquirectangularReflectionMapping;
    even.needsUpdate = true;
    scene.environment = even;
  }
  const camera = new THREE.PerspectiveCamera(40, 1, 0.1, 100);
  camera.position.z = 4;
  const target = new THREE.WebGLRenderTarget(SIDE, SIDE, { type: THREE.FloatType });
  const pixels = new Float32Array(4 * SIDE * SIDE);
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  if (later) {
    set(made, later);
    renderer.render(scene, camera);
  }
  renderer.readRenderTargetPixels(target, 0, 0, SIDE, SIDE, pixels);
  target.dispose();
  return Array.from(pixels);
}
