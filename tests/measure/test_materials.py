"""Tables as materials: evaluated, sampled, rendered, named, written into shaders."""

from __future__ import annotations

import json
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.catalog import notation
from gonio.errors import InputError
from gonio.measure import SAMPLE, compare
from gonio.measure.warp import Warp
from gonio.ops import backend
from gonio.verify import verify

pytestmark = pytest.mark.long  # the files that it reads are made first


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The sample as a table of each kind."""
    folder = tmp_path_factory.mktemp("tables")
    found = {}
    for suffix in (".binary", ".bsdf", ".zbsdf", ".brdf"):
        found[suffix] = str(folder / f"a{suffix}")
        compare.convert(SAMPLE, found[suffix])
    return found


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".binary", ".bsdf", ".zbsdf"])
def test_a_table_keeps_the_laws(suffix: str, files: dict[str, str]) -> None:
    found = verify(go.Measured(files[suffix]), quick=True, law=["pdf", "weight", "calls", "positivity"])
    assert found.passed, str(found)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".binary", ".bsdf"])
def test_a_table_is_recorded_as_it_is_computed(suffix: str, files: dict[str, str]) -> None:
    model = go.Measured(files[suffix])
    rng = np.random.default_rng(3)
    wo, wi = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in np.abs(rng.normal(size=(2, 200, 3))))
    wi[:, 0] *= -1.0
    for method in ("eval", "pdf"):
        values = model.record(method).evaluate(wo=wo.T, wi=wi.T)
        computed = getattr(model, method)(wo, wi, precision="float64")
        np.testing.assert_allclose(np.asarray(values).T, computed, rtol=1e-7, atol=1e-12)


@pytest.mark.sample(1)
@pytest.mark.parametrize("language", ["glsl", "wgsl", "hlsl"])
def test_a_shader_carries_the_tables(language: str, files: dict[str, str]) -> None:
    from gonio.shaders.bundle import bundle

    made = bundle(go.Measured(files[".binary"]), language)
    sizes = {name.rpartition("_")[0]: values.shape for name, values in made.tables.items()}
    assert sizes["table_half_difference"][-1] == 4 and np.prod(sizes["table_half_difference"]) == 4 * 90**3
    assert "fetch_half_difference" in made.text and "lookup_half" not in made.text


def test_a_file_is_a_material_wherever_one_is_named(files: dict[str, str]) -> None:
    model, values = notation.named(files[".binary"])
    assert isinstance(model, go.Measured) and values["file"] == files[".binary"]
    inside = notation.named(f"mix(a={files['.bsdf']},b=lambert,weight=.5)")[0]
    assert isinstance(inside.a, go.Measured)
    assert notation.written(model) == f"measured(file={files['.binary']})"
    assert notation.named(notation.written(model))[0] == model


def test_a_scene_takes_a_file_of_its_own_folder_only(scene: Path, files: dict[str, str]) -> None:
    from gonio import scene as scenes

    text = json.loads((scene / "scene.json").read_text())
    (scene / "gold.binary").write_bytes(Path(files[".binary"]).read_bytes())
    text["scene"]["shapes"][0]["material"] = {"type": "measured", "file": "gold.binary"}
    (scene / "scene.json").write_text(json.dumps(text))
    picture = go.render(scene, spp=4)
    assert np.isfinite(picture).all() and picture.max() > 0.0
    text["scene"]["shapes"][0]["material"]["file"] = files[".binary"]
    (scene / "scene.json").write_text(json.dumps(text))
    with pytest.raises(InputError, match="lies outside the scene's folder"):
        scenes.read(scene)
    assert scenes.read(scene, allow_outside=True)


def test_a_warp_and_its_inverse_agree_and_integrate_to_one() -> None:
    warp = Warp("w", np.random.default_rng(2).random((3, 5, 9)) ** 3)
    types, count = backend.types("float64"), 4000
    rng = np.random.default_rng(4)
    u, v = (types.float(part) for part in rng.random((2, count)))
    t = types.float(rng.random(count))
    slices = [(0.0 * t, 1.0 - t), (0.0 * t + 1.0, t)]
    place = warp.sample(slices, u, v)
    back = warp.invert(slices, place.x, place.y)
    for one, other in ((back.x, u), (back.y, v), (back.pdf, place.pdf)):
        np.testing.assert_allclose(np.array(one), np.array(other), rtol=1e-9, atol=1e-12)
    x, y = (
        types.float(part.ravel()) for part in np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(400) + 0.5) / 400)
    )
    assert np.array(warp.pdf([(0.0 * x, 1.0 + 0.0 * x)], x, y)).mean() == pytest.approx(1.0, abs=1e-3)


def test_rgl_tables_are_read_as_mitsuba_reads_them(shared: Path) -> None:
    file = shared / "data" / "rgl" / "satin_rosaline_rgb.bsdf"
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    rng = np.random.default_rng(0)
    wo, wi = rng.normal(size=(2, 20_000, 3))
    for w in (wo, wi):
        w[:, 2] = np.abs(w[:, 2]) + 0.1
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    wo, wi = wo.astype(np.float32).astype(float), wi.astype(np.float32).astype(float)
    model = go.Measured(str(file))
    theirs = mi.load_dict({"type": "measured", "filename": str(file)})
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(*wo.T.astype(np.float32))
    light = mi.Vector3f(*wi.T.astype(np.float32))
    value, pdf = (np.array(part(mi.BSDFContext(), si, light)).T for part in (theirs.eval, theirs.pdf))
    np.testing.assert_allclose(model.eval(wo, wi, precision="float64"), value, rtol=1e-3)
    np.testing.assert_allclose(model.pdf(wo, wi, precision="float64"), pdf, rtol=1e-3)
