"""OSL has the values of Python: compiled and run by Cycles, where Blender's module `bpy` is installed."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import parity
import pytest
from gonio.shaders import Bundle, bundle
from gonio.shaders.languages import languages
from gonio.shaders.table_files import FORMATS
from variants import EVERY, GLASS, GOLD

OSL = languages()["osl"]
COUNT = 1024  # draws per material, one per column of the film
ROWS = 7  # colors per draw, one below the other
# the Python with `bpy`, which brings 300 MB and wants a Python of its own
PYTHON = os.environ.get("GONIO_BPY", sys.executable)

JUDGE = """
float given(int i) {{
    float column = (floor(P[0] * {count}) + 0.5) / {count};
    return texture("{inputs}", column, 0.5 * (i + 0.5) / {numbers}, "interp", "closest");
}}
shader judge(output closure color BSDF = 0) {{
    {lines}
    BSDF = emission() * (color)value;
}}
"""


def test_the_text_has_the_form_of_osl() -> None:
    text = go.emit(go.KullaConty(GOLD), "osl", constants=True, prefix="g_")
    code = re.sub(r"//.*", "", text)
    assert not re.search(r"\b(const|true|false|bool|vec[234]|uniform|static)\b", code)
    assert not re.search(r"\.[xyzrgb]{2}", code)  # no components at once
    heads = re.findall(r"^\w+ (\w+)\([^;]*\) \{", code, re.M)
    assert len(heads) == len(set(heads)) and all(name.startswith("g_") for name in heads)
    assert (
        code.startswith("\n") and '#include "vector2.h"' in code and "#define g_PI" not in code.partition("struct")[2]
    )
    assert "g_KullaConty g_KullaConty_values()" in code


def test_tables_are_pictures_that_either_direction_of_rows_reads(tmp_path: Path) -> None:
    made = bundle(go.KullaConty(GOLD), "osl")
    made.write(tmp_path)
    assert f'#define table_missing_ggx_smith_correlated "{made.manifest["textures"][0]["file"]}"' in made.text
    for texture in made.manifest["textures"]:
        import mitsuba as mi

        picture = np.array(mi.Bitmap(str(tmp_path / texture["file"])))
        rows = made.tables[texture["uniform"]].reshape(-1, texture["size"][0], texture["channels"])
        assert np.array_equal(picture.reshape(-1, *rows.shape[1:]), np.concatenate([rows, rows[::-1]]))


def _lines(made: Bundle, draws: parity.Draws) -> list[str]:
    """The statements that answer the draw of a column with the color of a row."""
    manifest, functions, place = made.manifest, made.manifest["functions"], 9
    derived = ", derived" if manifest["derived"] else ""
    fields = {field["path"]: field for field in manifest["fields"]}
    lines = [f"{manifest['struct']} self;"]
    for path, rows in draws.fields.items():
        numbers = ", ".join(f"given({place + i})" for i in range(rows.shape[1]))
        type_ = {"float": "float", "vec2": "vector2", "vec3": "vector"}[fields[path]["type"]]
        lines.append(f"self.{fields[path]['name']} = {type_}({numbers});")
        place += rows.shape[1]
    if manifest["derived"]:
        lines.append(f"{manifest['derived']['struct']} derived = {functions['derive']}(self);")
    lines += [f"vector {name} = vector({', '.join(f'given({3 * i + j})' for j in range(3))});"
              for i, name in enumerate(("wo", "wi", "numbers"))]  # fmt: skip
    lines += [
        f"Sample s = {functions['sample']}(self{derived}, wo, numbers);",
        f"int row = int(floor(P[1] * {COUNT}));",
        "vector value = vector(0.0);",
        f"if (row == 0) value = {functions['eval']}(self{derived}, wo, wi);",
        f"if (row == 1) value = vector({functions['pdf']}(self{derived}, wo, wi), s.pdf, s.delta);",
        "if (row == 2) value = s.wi;",
        "if (row == 3) value = s.weight;",
    ]
    names = [term["name"] for term in manifest["terms"]]
    if names:
        lines.append(f"{manifest['struct']}Terms t = {functions['terms']}(self{derived}, wo, wi);")
    first = "t.D, t.G" if "D" in names else "0.0, 0.0"
    lines.append(f"if (row == 4) value = vector(s.eta, {first});")
    lines += [f"if (row == {place}) value = t.{name};" for place, name in ((5, "F"), (6, "multi")) if name in names]
    return lines


def _run(folder: Path, cases: dict[str, Bundle], draws: dict[str, parity.Draws]) -> dict[str, np.ndarray | None]:
    """The film of each case, (rows, columns, 3); None for text that does not compile."""
    jobs = []
    for name, made in cases.items():
        columns = draws[name].columns().T[..., None]
        picture = folder / f"{name}-inputs.exr"
        picture.write_bytes(FORMATS[OSL.tables].write(columns))
        given = {"inputs": picture.name, "count": COUNT, "numbers": len(columns)}
        judge = JUDGE.format(**given, lines="\n    ".join(_lines(made, draws[name])))
        for texture in made.manifest["textures"]:
            (folder / texture["file"]).write_bytes(FORMATS[OSL.tables].write(made.tables[texture["uniform"]]))
        (folder / f"{name}.osl").write_text(made.text + judge)
        jobs.append({"shader": f"{name}.osl", "width": COUNT, "height": ROWS})
    (folder / "jobs.json").write_text(json.dumps(jobs))
    script = Path(__file__).parent / "osl_in_cycles.py"
    done = subprocess.run([PYTHON, str(script), str(folder)], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    films = {name: folder / f"{name}.osl.npy" for name in cases}
    return {name: np.load(film) if film.exists() else None for name, film in films.items()}


def _unpacked(film: np.ndarray) -> dict[str, np.ndarray]:
    """The results by the names of `parity.judge`."""
    return {
        "eval": film[0],
        "pdf": film[1, :, 0],
        "sample.pdf": film[1, :, 1],
        "sample.delta": film[1, :, 2],
        "sample.wi": film[2],
        "sample.weight": film[3],
        "sample.eta": film[4, :, 0],
        "terms.D": film[4, :, 1],
        "terms.G": film[4, :, 2],
        "terms.F": film[5],
        "terms.multi": film[6],
    }


def _available() -> bool:
    return subprocess.run([PYTHON, "-c", "import bpy"], capture_output=True, timeout=120).returncode == 0


SOME = {
    "turned": EVERY["metal-bounded-turned"],
    "glass": GLASS,
    "tables": go.KullaConty(GOLD),
    "logarithms": EVERY["shifted-gamma"],
}
# `vector2.h` divides by a product with the reciprocal, one rounding more than the float64 of Python is moved by
OF_ALLOWED = 1.5


@pytest.mark.slow
def test_cycles_gives_the_values_of_python(tmp_path: Path) -> None:
    if not _available():
        pytest.skip("OSL was NOT TRIED: no Blender here (pip: bpy, in any environment; GONIO_BPY names its Python)")
    cases: dict[str, Any] = {name: bundle(material, "osl") for name, material in SOME.items()}
    draws = {name: parity.draw(material, np.random.default_rng(7), COUNT) for name, material in SOME.items()}
    metal = cases["turned"]
    wrong = Bundle(metal.text.replace("half_vector(wo, wi)", "missing(wo, wi)"), metal.manifest, {})
    films = _run(tmp_path, {**cases, "wrong": wrong}, {**draws, "wrong": draws["turned"]})
    assert films.pop("wrong") is None
    for name, film in films.items():
        assert film is not None, f"{name} does not compile"
        terms = [term["name"] for term in cases[name].manifest["terms"]]
        for result, verdict in parity.judge(SOME[name], draws[name], _unpacked(film), terms).items():
            assert verdict.ratio <= OF_ALLOWED, (name, result, verdict)
