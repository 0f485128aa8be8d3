"""Emit, read back, compare: GLSL and WGSL written by Gonio, read as shaders, have the values of their material.

Constants of a shader have 32 bits, and sines are polynomials, so the reference is the material's own recording for
shaders, with its constants rounded likewise.
"""

from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.material import recording, tree
from gonio.ops import graph
from gonio.shaders.polyfills import POLYFILLS
from gonio.spirv.compiler import compiler

MODELS = ["lambert", "conductor", "phong", "blinn-phong", "eon", "dielectric", "ward", "ashikhmin-shirley", "lafortune"]
METHODS = {"eval": "wi", "pdf": "wi", "sample": "u"}


def _rounded(recorded: graph.Graph) -> None:
    """Round the recording's constants to 32 bits."""

    def single(value: object) -> object:
        return float(np.float32(value)) if isinstance(value, float) else value

    for function in recorded.functions:
        for node in function.nodes:
            node.args = tuple(map(single, node.args))
            if node.op == "constant":
                node.static = single(node.static)


def _values(material: go.BSDF, method: str, arguments: dict[str, np.ndarray], for_shaders: bool) -> list[np.ndarray]:
    """A method's results in NumPy, component first.

    for_shaders  whether with constants of 32 bits, and with the functions that replace those of a language
    """
    into = graph.Graph(POLYFILLS, single=True) if for_shaders else graph.Graph()
    inner = type(material).__dict__.get(method) or getattr(type(material), method)
    inner = inner.__wrapped__ if hasattr(inner, "__wrapped__") else inner
    more = {} if method == "pdf" else {"mode": "radiance"}
    kinds = {"wo": "vec3", METHODS[method]: "vec3"}
    recorded = ops.record(inner, types=kinds, name=method, into=into, self=recording.symbols(material), **more)
    if for_shaders:
        _rounded(recorded)
    given = {}
    for leaf in tree.leaves(material):
        if leaf.parameter.numeric:
            value = np.asarray(leaf.value, float)
            size = {"spectrum": 3, "alpha": 2}.get(leaf.parameter.kind, 0)
            given[f"self_{leaf.path}"] = np.broadcast_to(value, (size,))[:, None] if size else value
    result = recorded.evaluate(**given, **arguments)
    parts = result[:3] if method == "sample" else [result]
    return [np.asarray(part) for part in parts]


@pytest.mark.parametrize("language", ["glsl", "wgsl"])
@pytest.mark.parametrize("name", MODELS)
def test_text_read_back_has_the_values_of_its_material(
    name: str, language: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # steps of the logarithm for shaders, which a material itself never takes
    monkeypatch.setitem(graph.NUMPY, "exponent", lambda x: np.frexp(x)[1] - 1.0)
    monkeypatch.setitem(graph.NUMPY, "scaled", lambda x, e: np.ldexp(x, np.asarray(e, int)))
    if language == "glsl":
        try:
            compiler()
        except Exception as error:
            pytest.skip(f"NOT TRIED: {error}")
    material = go.material(name) if name not in go.models() else go.models()[name]()
    file = tmp_path / f"{name}.{language}"
    file.write_text(go.emit(material, language))
    (tmp_path / f"{name}.toml").write_text(f"transmits = {str(material.transmits).lower()}\n")
    cls = type(go.Shader(file))
    values = {}
    for field in cls.parameters():
        path, _, letter = field.rpartition("_") if field.endswith(("_x", "_y")) else (field, "", "")
        value = getattr(material, path)
        values[field] = value if not letter or np.ndim(value) == 0 else value["xy".index(letter)]
    read_back = cls(**values)
    random = np.random.default_rng(5)
    wo, wi = (v / np.linalg.norm(v, axis=0) for v in random.normal(size=(2, 3, 500)))
    if not material.transmits:
        wo, wi = (v * [[1.0], [1.0], [1.0]] * np.where(v[2] < 0, -1.0, 1.0) for v in (wo, wi))
    for method, other in METHODS.items():
        arguments = {"wo": wo, other: wi if other == "wi" else random.random((3, 500))}
        for ours, theirs in zip(
            _values(read_back, method, arguments, False), _values(material, method, arguments, True), strict=True
        ):
            np.testing.assert_allclose(ours, theirs, rtol=1e-11, atol=1e-13)
