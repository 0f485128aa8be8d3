/** glTF and OBJ files as one geometry, by three.js' own readers. */
import { BufferAttribute, BufferGeometry, Mesh, type Object3D, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";

export async function parseMesh(file: File): Promise<BufferGeometry> {
  const name = file.name.toLowerCase();
  if (name.endsWith(".obj")) return merged(new OBJLoader().parse(await file.text()), file.name);
  if (name.endsWith(".glb") || name.endsWith(".gltf")) {
    const gltf = await new GLTFLoader().parseAsync(await file.arrayBuffer(), "");
    return merged(gltf.scene, file.name);
  }
  throw new Error(`${file.name} is not a mesh: drop .glb, .gltf or .obj.`);
}

/** All meshes of a scene, in world space. */
function merged(root: Object3D, name: string): BufferGeometry {
  root.updateMatrixWorld(true);
  const positions: number[] = [];
  const normals: number[] = [];
  const uvs: number[] = [];
  let everyUv = true;
  const point = new Vector3();
  root.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    const indexed = object.geometry as BufferGeometry;
    const geometry = indexed.getIndex() ? indexed.toNonIndexed() : indexed;
    if (!geometry.getAttribute("normal")) geometry.computeVertexNormals();
    const position = geometry.getAttribute("position");
    const normal = geometry.getAttribute("normal");
    const uv = geometry.getAttribute("uv");
    everyUv &&= Boolean(uv);
    for (let i = 0; i < position.count; i++) {
      point.fromBufferAttribute(position, i).applyMatrix4(object.matrixWorld);
      positions.push(point.x, point.y, point.z);
      point.fromBufferAttribute(normal, i).transformDirection(object.matrixWorld);
      normals.push(point.x, point.y, point.z);
      uvs.push(uv?.getX(i) ?? 0, uv?.getY(i) ?? 0);
    }
  });
  if (positions.length === 0) throw new Error(`${name} holds no mesh.`);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute("normal", new BufferAttribute(new Float32Array(normals), 3));
  if (everyUv) geometry.setAttribute("uv", new BufferAttribute(new Float32Array(uvs), 2));
  return geometry;
}
