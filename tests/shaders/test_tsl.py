"""TSL: modules run in Node, with numbers in place of nodes, and with three.js itself where it is installed."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.shaders import bundle
from variants import GLASS, GOLD

HERE = Path(__file__).parent
THREE = HERE.parents[1] / "web" / "node_modules" / "three"
NODE = shutil.which("node")
SOME = {"metal": GOLD, "tables": go.KullaConty(GOLD), "glass": GLASS, "error function": go.model("sheen")()}

RUN = """
import * as tsl from 'TSL';
import * as shader from './shader.mjs';
import { readFileSync } from 'node:fs';
const { functions, struct, tables, pairs } = JSON.parse(readFileSync('given.json'));
for (const [name, table] of Object.entries(tables)) if (NUMBERS) shader[name].value = table;
const values = pairs.map(([wo, wi]) => {
  const [a, b] = [wo, wi].map((v) => tsl.vec3(...v.map((x) => tsl.float(x))));
  const material = shader[`${struct}_values`];
  const derived = functions.derive ? [shader[functions.derive](material)] : [];
  return [shader[functions.eval](material, ...derived, a, b), shader[functions.pdf](material, ...derived, a, b),
    shader[functions.sample](material, ...derived, a, b).wi];
});
console.log(JSON.stringify(NUMBERS ? values.map((row) => row.map((value) => value.parts)) : values.length));
"""


def _run(model: go.BSDF, folder: Path, numbers: bool) -> tuple[object, np.ndarray, np.ndarray]:
    """What the module says for random pairs; the pairs."""
    if NODE is None:
        pytest.skip("TSL was ONLY PRINTED, NOT RUN: no node here")
    made = bundle(model, "tsl", constants=True)
    wo, wi = np.random.default_rng(2).normal(size=(2, 20, 3))
    wo, wi = (np.abs(v) / np.linalg.norm(v, axis=1, keepdims=True) for v in (wo, wi))
    wi[:, :2] *= -1.0
    nodes = (HERE / "tsl_numbers.mjs" if numbers else THREE / "build" / "three.tsl.js").as_uri()
    three = nodes if numbers else (THREE / "build" / "three.webgpu.js").as_uri()
    text = made.text.replace("'three/tsl'", f"'{nodes}'").replace("'three'", f"'{three}'")
    tables = {
        texture["uniform"]: {
            "data": made.tables[texture["uniform"]].ravel().tolist(), "size": texture["size"],
            "channels": texture["channels"],
        }
        for texture in made.manifest["textures"]
    }  # fmt: skip
    given = {**made.manifest, "tables": tables if numbers else {}, "pairs": np.stack([wo, wi], 1).tolist()}
    (folder / "shader.mjs").write_text(text)
    (folder / "given.json").write_text(json.dumps(given))
    (folder / "run.mjs").write_text(RUN.replace("TSL", nodes).replace("NUMBERS", "true" if numbers else "false"))
    done = subprocess.run([NODE, "run.mjs"], cwd=folder, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), wo, wi


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", SOME)
def test_the_module_says_what_gonio_says(name: str, tmp_path: Path) -> None:
    rows, wo, wi = _run(SOME[name], tmp_path, numbers=True)
    go.set_precision("float64")
    values = [np.array(column, float).squeeze() for column in zip(*rows, strict=True)]  # type: ignore[call-overload]
    assert np.allclose(values[0], SOME[name].eval(wo, wi), rtol=1e-5, atol=1e-7)
    assert np.allclose(values[1], SOME[name].pdf(wo, wi), rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("name", SOME)
def test_three_accepts_the_module(name: str, tmp_path: Path) -> None:
    if not THREE.is_dir():
        pytest.skip("TSL was NOT TRIED with three.js: no web/node_modules (npm ci)")
    rows, _, _ = _run(SOME[name], tmp_path, numbers=False)
    assert rows == 20
