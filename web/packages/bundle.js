// The folder that `gonio emit -o DIR/` writes, read in a browser. `npm pack` copies this file into each package.

/**
 * Read manifest, shader text and tables of a bundle.
 * @param {string} url address of the folder
 * @param {string} lang language that the shader must have, as `gonio emit --lang` names it
 * @param {string} [model] the material's name, such as "conductor", where the bundle is a module of several
 * @returns {Promise<{manifest: object, text: string, tables: Object<string, Float32Array>}>}
 */
export async function read(url, lang, model) {
  const folder = url.endsWith("/") ? url : `${url}/`;
  const whole = await (await answer(`${folder}manifest.json`)).json();
  if (whole.lang !== lang) {
    throw new Error(`${folder} is a bundle in ${whole.lang}: write it by gonio emit --lang ${lang}`);
  }
  const manifest = whole.materials ? member(whole.materials, model, folder) : whole;
  if (!manifest.functions.eval) throw new Error(`${folder} has no eval: write it by gonio emit --functions eval`);
  const text = await (await answer(folder + manifest.shader)).text();
  const floats = async ({ uniform, file, format, file_format }) => {
    if (file_format !== "raw" || !format.endsWith("32float")) {
      throw new Error(`${folder}${file} is no table of 32-bit numbers: write it without --half and --tables`);
    }
    return [uniform, littleEndian(await (await answer(folder + file)).arrayBuffer())];
  };
  return { manifest, text, tables: Object.fromEntries(await Promise.all(manifest.textures.map(floats))) };
}

/**
 * The fields of the shader's struct: the bundle's own values, replaced by those given.
 * @param {object} manifest
 * @param {Object<string, number | number[]>} values by the parameter's path, such as "base.alpha": one number for a
 *   pair or a color of equal components; an angle in rad
 * @returns {Object<string, number[]>} by the field's name
 */
export function fields(manifest, values = {}) {
  const found = Object.fromEntries(manifest.fields.map(({ name, value }) => [name, [value].flat()]));
  for (const [path, value] of Object.entries(values)) {
    const field = fieldOf(manifest, path);
    found[field.name] = components(manifest.parameters.find((one) => one.path === path), field, [value].flat());
  }
  return found;
}

/** The field of a parameter that may vary in this shader. */
export function fieldOf(manifest, path) {
  const field = manifest.fields.find((one) => one.path === path);
  if (!field) {
    const known = manifest.fields.map((one) => one.path).join(", ");
    throw new Error(`${path}: no parameter that varies in this shader of ${manifest.title}: they are ${known}`);
  }
  if (manifest.parameters.find((one) => one.path === path).fixed) {
    throw new Error(`${path}: the tables depend on it, so another value needs another bundle`);
  }
  return field;
}

function components({ path, kind, low, high, value }, { type }, given) {
  const width = { float: 1, vec2: 2, vec3: 3 }[type];
  const most = kind === "angle" ? 1 : width;
  if (!given.every(Number.isFinite) || ![1, most].includes(given.length)) {
    throw new Error(`${path}: ${given} given, ${most === 1 ? "a number" : `1 or ${most} numbers`} expected`);
  }
  if (given.some((x) => x < (low ?? -Infinity) || x > (high ?? Infinity))) {
    throw new Error(`${path}: ${given} given, from ${low ?? "-infinity"} to ${high ?? "infinity"} expected`);
  }
  if (kind === "alpha" && new Set(given).size > 1 && !Array.isArray(value)) {
    throw new Error(`${path}: two widths given to a shader of one: emit the material with two`);
  }
  if (kind === "angle") return [Math.cos(given[0]), Math.sin(given[0])];
  return given.length === width ? given : Array(width).fill(given[0]);
}

async function answer(address) {
  const response = await fetch(address);
  if (!response.ok) throw new Error(`${address}: ${response.status} ${response.statusText}`);
  return response;
}

function member(materials, model, folder) {
  const found = materials.find((one) => one.model === model);
  if (!found) throw new Error(`${folder}: name one of ${materials.map((one) => one.model).join(", ")}, not ${model}`);
  return found;
}

function littleEndian(buffer) {
  const view = new DataView(buffer);
  return Float32Array.from({ length: buffer.byteLength / 4 }, (_, i) => view.getFloat32(4 * i, true));
}
