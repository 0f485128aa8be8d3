// Materials that gonio emits in WGSL, in WebGPU.
import { fields, read } from "./bundle.js";

/**
 * Read a folder that `gonio emit MATERIAL --lang wgsl -o DIR/` wrote.
 * @param {string} url address of the folder
 * @param {string} [model] the material's name, where the folder holds several
 */
export const load = (url, model) => read(url, "wgsl", model);

/**
 * What a pipeline needs: tables are uploaded, the struct is laid out as a uniform buffer has it.
 * @param {GPUDevice} device
 * @param {object} bundle from `load`
 * @param {Object<string, number | number[]>} [values] by the parameter's path; others are the bundle's
 * @returns {{text: string, group: number, layout: GPUBindGroupLayout, bindGroup: GPUBindGroup, bytes: ArrayBuffer}}
 *   group     the index that layout and bind group of the tables have in the pipeline
 *   bytes     of the struct `bundle.manifest.struct`, for a uniform buffer in a group of the program's own
 */
export function bindings(device, { manifest, text, tables }, values = {}) {
  const layout = device.createBindGroupLayout({
    entries: manifest.textures.map(({ binding, dimension }) => ({
      binding,
      visibility: GPUShaderStage.VERTEX | GPUShaderStage.FRAGMENT | GPUShaderStage.COMPUTE,
      texture: { sampleType: "unfilterable-float", viewDimension: `${dimension}d` },
    })),
  });
  const entries = manifest.textures.map((texture) => ({
    binding: texture.binding,
    resource: uploaded(device, texture, tables[texture.uniform]).createView(),
  }));
  const group = manifest.textures[0]?.group ?? 0;
  const bindGroup = device.createBindGroup({ layout, entries });
  return { text, group, layout, bindGroup, bytes: bytes(manifest, values) };
}

/** The struct's bytes for other values of the same bundle: `device.queue.writeBuffer(buffer, 0, bytes(...))`. */
export function bytes(manifest, values = {}) {
  const block = new DataView(new ArrayBuffer(manifest.size));
  const found = fields(manifest, values);
  for (const { name, offset } of manifest.fields) {
    found[name].forEach((x, i) => block.setFloat32(offset + 4 * i, x, true));
  }
  return block.buffer;
}

function uploaded(device, { uniform, dimension, size, format, channels }, data) {
  const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
  const texture = device.createTexture({ label: uniform, size, dimension: `${dimension}d`, format, usage });
  const rows = { bytesPerRow: 4 * channels * size[0], rowsPerImage: size[1] };
  device.queue.writeTexture({ texture }, data, rows, size);
  return texture;
}
