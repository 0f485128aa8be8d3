/** glTF and OBJ files as one geometry, read by three.js. */
import { BufferAttribute, BufferGeometry, LoadingManager, Mesh, MeshBasicMaterial, type Object3D, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";

/** `companions`: the files dropped with it; a .gltf may have its data in a .bin. */
export async function parseMesh(file: File, companions: readonly File[]): Promise<BufferGeometry> {
  const root = /\.obj$/i.test(file.name) ? new OBJLoader().parse(await file.text()) : await parseGltf(file, companions);
  return merged(root, file.name);
}

async function parseGltf(file: File, companions: readonly File[]): Promise<Object3D> {
  const urls: string[] = [];
  let missing = "";
  const manager = new LoadingManager();
  manager.setURLModifier((address) => {
    if (/^(data|blob):/.test(address)) return address;
    const name = decodeURIComponent(address).split("/").pop() as string;
    const match = companions.find((other) => other.name === name);
    if (!match) missing ||= name;
    urls.push(URL.createObjectURL(match ?? new Blob()));
    return urls[urls.length - 1] as string;
  });
  const loader = new GLTFLoader(manager);
  // The page has its own materials: the file's textures are not loaded.
  const material = new MeshBasicMaterial();
  loader.register(() => ({ name: "no-materials", loadMaterial: () => Promise.resolve(material) }));
  try {
    return (await loader.parseAsync(await file.arrayBuffer(), "")).scene;
  } catch (error) {
    if (missing) throw new Error(`${file.name} refers to ${missing}: drop both files together, or a .glb.`);
    throw new Error(`${file.name} cannot be read: ${error instanceof Error ? error.message.replace(/^THREE\.\w+: /, "") : String(error)}`);
  } finally {
    for (const address of urls) URL.revokeObjectURL(address);
  }
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
    if (!position.array.every(Number.isFinite)) throw new Error(`${name}: a vertex of a face is missing or not a number.`);
    everyUv &&= Boolean(uv);
    for (let i = 0; i < position.count; i++) {
      point.fromBufferAttribute(position, i).applyMatrix4(object.matrixWorld);
      positions.push(point.x, point.y, point.z);
      point.fromBufferAttribute(normal, i).transformDirection(object.matrixWorld);
      normals.push(point.x, point.y, point.z);
      uvs.push(uv?.getX(i) ?? 0, uv?.getY(i) ?? 0);
    }
  });
  if (positions.length === 0) throw new Error(`${name} contains no mesh.`);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute("normal", new BufferAttribute(new Float32Array(normals), 3));
  if (everyUv) geometry.setAttribute("uv", new BufferAttribute(new Float32Array(uvs), 2));
  return geometry;
}
