"""Materials as Python files: NumPy, PyTorch and JAX say what Gonio says."""

from __future__ import annotations

import functools
import importlib.util
import types
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import cli
from gonio.shaders import Placement, bundle
from parity import Draws, draw, reference
from variants import EVERY, GOLD

import materials

ROUNDING = np.finfo(float).eps
COUNT = 2000
# one of each kind of formula: tables, selections, spectra, delta lobes, the error function, angles
SOME = ["oren-nayar", "mix-with-mirror", "kulla-conty", "shifted-gamma", "glass-turned"]
QUICK = [*SOME, "metal-by-colours", "sheen-charlie"]  # besides, constants that are selected, and in places of tables
JUDGED = [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in EVERY]


def _loaded(text: str) -> Any:
    made = types.ModuleType("written")
    exec(compile(text, "written.py", "exec"), made.__dict__)
    return made


@functools.cache
def _draws(name: str) -> Draws:
    """Random inputs as float64, so that they can be moved by one rounding."""
    draws = draw(EVERY[name], np.random.default_rng(5), COUNT)
    fields = {path: rows.astype(float) for path, rows in draws.fields.items()}
    return Draws(draws.wo.astype(float), draws.wi.astype(float), draws.u.astype(float), fields)


def _moved(draws: Draws, seed: int) -> Draws:
    rng = np.random.default_rng(seed)

    def near(x: np.ndarray) -> np.ndarray:
        signs = rng.choice([-1.0, 1.0], x.shape)
        return np.where(x == 0.0, 1e-30 * signs, x * (1.0 + ROUNDING * signs))

    return Draws(near(draws.wo), near(draws.wi), near(draws.u), {p: near(x) for p, x in draws.fields.items()})


def _called(file: Any, manifest: Any, method: str, draws: Draws, number: Any) -> tuple[Any, ...]:
    """The file's own function on every draw, which takes angles as (cos, sin)."""

    def vector(x: np.ndarray) -> Any:
        return file.Vector(*(number(column) for column in x.T))

    rows = {field["path"]: field["type"] for field in manifest["fields"]}
    fields = [
        number(draws.fields[path][:, 0]) if type_ == "float" else vector(draws.fields[path])
        for path, type_ in rows.items()
    ]
    material = file._MATERIAL(*(fields or [0.0]))
    derived = [getattr(file, manifest["functions"]["derive"])(material)] if manifest["derived"] else []
    wo, other = vector(draws.wo), vector(draws.u if method == "sample" else draws.wi)
    result = file._result(getattr(file, manifest["functions"][method])(material, *derived, wo, other), wo)
    return result if isinstance(result, tuple) else (result,)


def _check(name: str, language: str, number: Any) -> None:
    """Each value within 8 roundings, or 8 times what one rounding of the inputs changes; 1 in 100 may exceed it, and 3
    in 100 in JAX, whose exp and log are rounded otherwise."""
    share = 3e-2 if language == "jax" else 1e-2
    made, draws = bundle(EVERY[name], language), _draws(name)
    file = _loaded(made.text)
    for method in ("eval", "pdf", "sample"):
        with np.errstate(all="ignore"):
            written = [np.asarray(x, float) for x in _called(file, made.manifest, method, draws, number)]
        expected = [x.astype(float) for x in reference(EVERY[name], draws, method)]
        moved = [reference(EVERY[name], _moved(draws, seed), method) for seed in (1, 2, 3)]
        for place, (value, truth) in enumerate(zip(written, expected, strict=True)):
            size = np.linalg.norm(truth, axis=-1, keepdims=True) if truth.ndim == 2 else np.abs(truth)
            allowed = 8.0 * ROUNDING * np.maximum(size, 1e-6)
            for other in moved:
                allowed = np.maximum(allowed, 8.0 * np.abs(other[place].astype(float) - truth))
            wrong = ~(np.abs(value - truth) <= allowed) & ~(np.isnan(value) & np.isnan(truth)) & (value != truth)
            if method == "pdf":  # that of a guide depends on the azimuth, which the normal itself does not have
                wrong[np.any([np.all(v[:, :2] == 0.0, axis=1) for v in (draws.wo, draws.wi)], axis=0)] = False
            assert wrong.mean() <= share, (method, place, wrong.mean(), np.nanmax(np.abs(value - truth)))


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", materials.each(EVERY, SOME))
def test_numpy_says_what_gonio_says(name: str) -> None:
    _check(name, "numpy", np.asarray)


@pytest.mark.parametrize("name", JUDGED)
def test_torch_says_what_gonio_says(name: str) -> None:
    torch = pytest.importorskip("torch", reason="NOT TRIED: no torch here (pip: torch)")
    _check(name, "torch", torch.tensor)


@pytest.mark.parametrize("name", JUDGED)
def test_jax_says_what_gonio_says(name: str) -> None:
    jax = pytest.importorskip("jax", reason="NOT TRIED: no jax here (pip: jax)")
    with jax.enable_x64(True):
        _check(name, "jax", jax.numpy.asarray)


WO, WI = np.array([0.48, 0.0, 0.877268487978]), np.array([-0.3, 0.4, 0.866025403784])


def test_a_file_needs_numpy_alone_and_takes_arrays(tmp_path: Path) -> None:
    path = tmp_path / "gold.py"
    with pytest.raises(SystemExit) as done:
        cli.main(["emit", "conductor", "--preset", "Au", "-p", "alpha=0.3", "--language", "numpy", "-o", str(path)])
    assert not done.value.code and "gonio" not in path.read_text().replace("`gonio", "").partition("import")[2]
    spec = importlib.util.spec_from_file_location("gold", path)
    assert spec is not None and spec.loader is not None
    gold = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(gold)
    go.set_precision("float64")
    assert np.allclose(gold.eval(WO, WI), GOLD.eval(WO, WI), rtol=1e-13)
    assert gold.eval(WO, WI).shape == (3,) and gold.pdf(WO, np.stack([WI] * 4)).shape == (4,)
    sample = gold.sample(np.stack([WO] * 5), np.full((5, 3), 0.3), alpha=[0.2, 0.4])
    assert sample.wi.shape == sample.weight.shape == (5, 3) and sample.pdf.shape == sample.delta.shape == (5,)
    expected = go.Conductor.preset("Au", alpha=(0.2, 0.4)).sample(WO, np.full(3, 0.3))
    assert np.allclose(sample.wi[0], expected.wi, rtol=1e-12)
    with pytest.raises(TypeError, match="unknown parameter 'alfa'; known: eta, k, alpha, albedo"):
        gold.eval(WO, WI, alfa=0.2)


def test_angles_are_given_in_radians() -> None:
    turned = go.Conductor.preset("Au", alpha=(0.3, 0.1), rotation=0.3)
    file = _loaded(go.emit(turned, "numpy"))
    go.set_precision("float64")
    for angle in (0.3, -1.0):
        expected = go.Conductor.preset("Au", alpha=(0.3, 0.1), rotation=angle).eval(WO, WI)
        assert np.allclose(file.eval(WO, WI, rotation=angle), expected, rtol=1e-12)


@pytest.mark.parametrize("language", ["torch", "jax"])
def test_gradients_are_those_of_differences(language: str) -> None:
    library = pytest.importorskip(language, reason=f"NOT TRIED: no {language} here (pip: {language})")
    text = go.emit(go.KullaConty(GOLD), language)
    reference = _loaded(go.emit(go.KullaConty(GOLD), "numpy"))
    step = 1e-6
    sides = [reference.eval(WO, WI, base_alpha=0.3 + s).sum() for s in (-step, step)]
    expected = (sides[1] - sides[0]) / (2.0 * step)
    if language == "torch":
        alpha = library.tensor(0.3, dtype=library.float64, requires_grad=True)
        _loaded(text).eval(library.tensor(WO), library.tensor(WI), base_alpha=alpha).sum().backward()
        assert float(alpha.grad) == pytest.approx(expected, rel=1e-6)
        return
    with library.enable_x64(True):
        slope = library.jit(library.grad(lambda alpha: _loaded(text).eval(WO, WI, base_alpha=alpha).sum()))(0.3)
        assert float(slope) == pytest.approx(expected, rel=1e-6)


@pytest.mark.sample(1)
@pytest.mark.parametrize("language", ["numpy", "torch", "jax"])
def test_every_file_is_python(language: str) -> None:
    """Compiled, not run: no library is needed."""
    for name in SOME:
        compile(bundle(EVERY[name], language).text, name, "exec")


def test_a_file_holds_one_material_and_takes_no_prefix() -> None:
    with pytest.raises(go.InputError, match="2 materials given, but a numpy file contains one"):
        go.emit([GOLD, go.Lambert()], "numpy")
    with pytest.raises(go.InputError, match="a prefix, a binding or a table format given, but a numpy file"):
        bundle(GOLD, "numpy", placement=Placement("g_"))
