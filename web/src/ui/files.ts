/** Files dropped on the page or opened: a picture becomes the environment, a mesh the shape. */
import type { PageApp } from "../app";
import { type EnvironmentPicture, environmentFromFloats } from "../environment";
import { readFactors, applyFactors } from "../gltf-material";
import { newLight } from "../lights";
import { readMesh } from "../meshes";
import { readRadiance } from "../radiance";
import type { Light } from "../state";
import { studio } from "../studio";
import { element } from "./dom";

const ENVIRONMENT = ".hdr,.pic";
const MESH = ".glb,.gltf,.bin,.obj";
const PICTURES = /\.(hdr|pic)$/i;
const MESHES = /\.(glb|gltf|obj)$/i;

export function openFile(app: PageApp, kind: "environment" | "mesh"): void {
  const input = element("input", { type: "file", accept: kind === "environment" ? ENVIRONMENT : MESH, multiple: kind === "mesh" });
  input.addEventListener("change", () => void useFiles(app, [...(input.files ?? [])]));
  input.click();
}

/** The first picture or mesh of the files dropped together; it may refer to the others. */
export async function useFiles(app: PageApp, files: readonly File[]): Promise<void> {
  const file = files.find(({ name }) => PICTURES.test(name) || MESHES.test(name)) ?? files[0];
  if (!file) return;
  try {
    if (PICTURES.test(file.name)) {
      const picture = readRadiance(new Uint8Array(await file.arrayBuffer()), file.name);
      useEnvironment(app, picture.width, picture.height, picture.data);
    } else if (MESHES.test(file.name)) {
      app.useMesh(await readMesh(file, files.filter((other) => other !== file)));
      const factors = /\.obj$/i.test(file.name) ? null : readFactors(new Uint8Array(await file.arrayBuffer()));
      if (factors) return app.say(`${file.name} is in use; ${applyFactors(app, factors)}`);
    } else throw new Error(`${file.name}: drop a Radiance picture (.hdr) or a mesh (.glb, .gltf, .obj).`);
    app.say(`${file.name} is in use.`);
  } catch (error) {
    app.say(error instanceof Error ? error.message : String(error), "error");
  }
}

export function useEnvironment(app: PageApp, width: number, height: number, floats: Float32Array): void {
  setPicture(app, environmentFromFloats(app.gl, width, height, floats, 3));
  app.store.set("view.background", "environment");
}

/** The page's own studio as the environment. */
export const useStudio = (app: PageApp): void => setPicture(app, studio(app.gl));

function setPicture(app: PageApp, picture: EnvironmentPicture): void {
  app.environment = picture;
  app.store.update(["lights", "view"], (state) => {
    let light = state.lights.find((l) => l.type === "environment");
    if (!light) {
      light = newLight("environment") as Extract<Light, { type: "environment" }>;
      state.lights.push(light);
    }
    light.image = { width: picture.width, height: picture.height, data: null };
    light.on = true;
    state.furnace = false;
  });
}

export function attachDrop(app: PageApp, host: HTMLElement): void {
  let depth = 0;
  const mark = (on: boolean) => host.toggleAttribute("data-dropping", on);
  addEventListener("dragenter", (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    depth += 1;
    mark(true);
  });
  addEventListener("dragleave", () => {
    depth = Math.max(0, depth - 1);
    if (depth === 0) mark(false);
  });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    depth = 0;
    mark(false);
    void useFiles(app, [...(event.dataTransfer?.files ?? [])]);
  });
}
