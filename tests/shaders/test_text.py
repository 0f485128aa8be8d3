"""What the text of a shader keeps of its source, what the manifest tells, and how both are refused."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio import cli, ops
from gonio.energy.compensation import curves
from gonio.ops import Table, lookup
from gonio.shaders import bundle
from gonio.shaders.languages import languages
from gonio.shaders.syntax import literal
from gonio.shaders.textures import pixels
from variants import COMPENSATED, FEW, GOLD, SHAPES, written

LANGS = tuple(name for name, language in languages().items() if not language.standalone)


def _functions(text: str) -> dict[str, str]:
    """Functions of GLSL by name."""
    return dict(re.findall(r"^\w+ (\w+)\([^{]*\) \{\n(.*?)^\}", text, re.S | re.M))


def test_names_docstrings_citations_and_constants_of_the_source_survive() -> None:
    text = go.emit(GOLD)
    assert "half a disk (Heitz2014, eq. 72)" in text
    assert {"GGX_D", "GGX_Lambda", "half_vector", "masking_shadowing", "Conductor_reflectance"} <= set(_functions(text))
    assert "float over = 1.0 / (alpha.x * alpha.y);" in text and "const float SMOOTH = 0.0001;" in text
    assert "Below this width, the tilt of facets" in text and "const float INV_PI = 0.31830987;" in text


@pytest.mark.parametrize("name", ["lafortune", "disney", "normal-map"])
def test_code_whose_values_may_tell_x_from_y_is_not_isotropic(name: str) -> None:
    """It was by the values that it was written with: a page took the albedo along x for that of all azimuths."""
    assert not bundle(name, "glsl").manifest["isotropic"]


@pytest.mark.slow
def test_the_manifest_tells_what_tables_were_found_from() -> None:
    fixed = {p["path"] for p in bundle("coat", "glsl").manifest["parameters"] if p["fixed"]}
    assert "base.alpha" in fixed and "depth" not in fixed


@pytest.mark.slow
def test_functions_that_differ_in_a_number_alone_are_one() -> None:
    for name in FEW:
        copies = [f for f in _functions(written(name).text) if re.fullmatch(r".*_[3-9]|.*_\d\d", f)]
        assert not copies, (name, copies)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", FEW)
def test_nothing_is_defined_and_not_used(name: str) -> None:
    shader = written(name)
    code = "\n".join(line for line in shader.text.splitlines() if not line.startswith("//"))
    entries = set(shader.manifest["functions"].values())
    for function, body in _functions(code).items():
        if function not in entries:
            assert len(re.findall(rf"\b{function}\(", code)) > 1, function
        head = re.search(rf"^\w+ {function}\(([^{{]*?)\) \{{", code, re.M | re.S)
        assert head is not None
        for parameter in re.findall(r"(\w+)(?:,|$)", head[1].strip()):
            used = re.search(rf"\b{parameter}\b", body)
            assert used or function in entries, f"{function}: {parameter}"
        for local in re.findall(r"^    \w+ (\w+) = ", body, re.M):
            assert len(re.findall(rf"\b{local}\b", body)) > 1, f"{function}: {local}"


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", [n for n in COMPENSATED if "turquin" not in n])
def test_what_follows_from_parameters_alone_is_a_function_of_its_own(name: str) -> None:
    made = bundle(COMPENSATED[name])
    assert made.manifest["derived"]["struct"] == made.manifest["struct"] + "Derived"
    functions = _functions(made.text)
    derive = functions.pop(made.manifest["functions"]["derive"])
    # the table of M is read there, and nowhere else
    for field in made.manifest["derived"]["fields"]:
        assert any(re.search(rf"\bderived\.{field['name']}\b", body) for body in functions.values()), field
    readers = ["lookup_missing", *(name for name, body in functions.items() if "lookup_missing" in body)]
    assert any(name in derive for name in readers)
    others = {name: body for name, body in functions.items() if name not in readers}
    assert not [name for name, body in others.items() for reader in readers if reader in body]


@pytest.mark.sample(1)
@pytest.mark.parametrize("lang", LANGS)
def test_manifest_tells_what_a_program_must_know(lang: str) -> None:
    made = bundle(go.KullaConty(go.Conductor.preset("Au", alpha=(0.3, 0.1), rotation=0.5)), lang)
    m = made.manifest
    json.dumps(m, allow_nan=False)
    assert m["lang"] == lang and m["title"] == "KullaConty" and m["model"] == "kulla-conty"
    fields = {f["path"]: f for f in m["fields"]}
    alpha = fields["base.alpha"]
    assert (alpha["name"], alpha["type"], alpha["value"]) == ("base_alpha", "vec2", [0.3, 0.1]) and "width" in alpha[
        "doc"
    ]
    # eta, k, alpha, rotation, albedo
    assert [f["offset"] for f in m["fields"]] == [0, 16, 32, 40, 48]
    assert m["size"] == 64 and m["shader"] == "kulla-conty" + languages()[lang].suffix
    assert fields["base.rotation"]["value"] == pytest.approx([np.cos(0.5), np.sin(0.5)])
    assert [t["name"] for t in m["terms"]] == ["D", "G", "F", "single", "multi"] and all(t["doc"] for t in m["terms"])
    kinds = {p["path"]: p["kind"] for p in m["parameters"]}
    assert kinds["base.alpha"] == "alpha" and kinds["base.masking"] == "choice" and kinds["color"] == "choice"
    assert not m["transmits"] and not m["isotropic"] and m["delta"] == "never"
    for texture in m["textures"]:
        assert made.tables[texture["uniform"]].size == np.prod(texture["size"]) * texture["channels"]
    assert all(function in made.text for function in m["functions"].values())


def test_tables_lie_in_the_order_of_upload() -> None:
    table = curves.isotropic("ggx", "smith-correlated")
    texture = pixels(table)  # x: roughness, y: groups of four channels
    assert texture.shape == (3, table.shape[0], 4)
    assert texture[1, 7, 2] == np.float32(table.values[7, 6])
    deep = Table("deep", np.random.default_rng(1).random((3, 4, 5, 1)))
    assert pixels(deep).ravel()[(2 * 4 + 1) * 5 + 3] == np.float32(deep.values[2, 1, 3, 0])
    assert lookup(deep, 0.5 / 3 + 2 / 3, 1.5 / 4, 3.5 / 5)[0] == pytest.approx(deep.values[2, 1, 3, 0])


def test_literals_are_short_and_the_same_float32() -> None:
    assert [literal(x) for x in (0.5, 2.0, 1e-30, 0.1, 1e8)] == ["0.5", "2.0", "1.0e-30", "0.1", "1.0e8"]
    for x in np.random.default_rng(2).normal(size=500) * 10.0 ** np.random.default_rng(3).uniform(-30, 30, 500):
        text = literal(float(x))
        assert np.float32(text) == np.float32(x) and ("." in text)


def test_bundle_writes_shader_manifest_and_raw_tables(tmp_path: Path) -> None:
    made = bundle(go.KullaConty(GOLD), "wgsl")
    names = {path.name for path in made.write(tmp_path / "out")}
    assert {"kulla-conty.wgsl", "manifest.json"} < names
    assert json.loads((tmp_path / "out" / "manifest.json").read_text()) == made.manifest
    texture = made.manifest["textures"][0]
    raw = np.fromfile(tmp_path / "out" / texture["file"], "<f4")
    assert np.array_equal(raw, made.tables[texture["uniform"]].ravel())


def test_unknown_languages_functions_and_things_are_refused() -> None:
    with pytest.raises(go.InputError, match=r"unknown language 'glls'(?s:.*)did you mean 'glsl'"):
        go.emit(GOLD, "glls")
    with pytest.raises(go.InputError, match="unknown function 'evil'"):
        go.emit(GOLD, functions=("evil",))
    with pytest.raises(go.InputError, match="3 given, a material expected"):
        go.emit(3)  # type: ignore[arg-type]
    with pytest.raises(go.InputError, match="did you mean 'conductor'"):
        go.emit("conducter")
    assert go.emit("kulla-conty(color=sheet)") == go.emit(go.KullaConty(go.Conductor(alpha=0.3), color="sheet"))
    with pytest.raises(go.InputError, match="one value per ray given"):
        go.emit(go.Lambert(np.full((5, 3), 0.5)))


def test_what_cannot_be_a_shader_is_refused_with_one_clear_error() -> None:
    for refused, words in [
        (lambda: go.emit(GOLD, functions=3), "functions: 3 given, a string or several strings expected"),  # type: ignore[arg-type]
        (lambda: go.emit(GOLD, functions=()), "no function given"),
        (lambda: go.emit(GOLD, functions=" , "), "no function given"),
        (lambda: go.emit(GOLD, ["glsl"]), r"lang: \['glsl'\] given, a string expected"),  # type: ignore[arg-type]
        (lambda: go.emit(go.Lambert(), functions=["terms"]), "Lambert has no terms"),
        (lambda: go.emit(go.Conductor(alpha=np.array([0.1, 0.2, 0.3]))), "one value per ray given"),
        (lambda: go.emit(go.Conductor(eta=1e39)), r"1e\+39 given, at most 3\.4e38"),
        (
            lambda: go.emit(go.KullaConty(go.OrenNayar())),
            "cannot be written as shader code: .* measured by sampling",
        ),
    ]:
        with pytest.raises(go.InputError, match=words):
            refused()


def test_a_power_is_refused_with_the_function_to_use() -> None:
    class Powered(go.BSDF):
        """A lobe by Python's operator."""

        p: float = go.number(3.0, "exponent")

        def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
            """cos^p."""
            return ops.where(wi.z > 0.0, wi.z**self.p, 0.0)

    with pytest.raises(go.InputError, match=r"`\*\*` on a value(?s:.*)ops\.pow"):
        bundle(Powered(), functions=["eval"])


def test_functions_are_named_in_any_spelling_of_a_list() -> None:
    text = go.emit(GOLD, functions=["pdf", "eval"])
    assert go.emit(GOLD, functions=" pdf, eval,pdf") == text


def test_command_line_prints_writes_and_refuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def run(*arguments: str) -> int:
        with pytest.raises(SystemExit) as done:
            cli.main(["emit", *arguments])
        return int(done.value.code or 0)

    assert run("lambert", "--functions", "eval") == 0
    printed = capsys.readouterr().out
    assert "Lambert_eval" in printed and "Lambert_pdf" not in printed
    assert run("conductor", "--preset", "Au", "--lang", "hlsl", "-o", str(tmp_path / "gold.hlsl")) == 0
    assert "float3 Conductor_eval" in (tmp_path / "gold.hlsl").read_text()
    assert run("lambert", "--lang", "cg") == 2
    assert run("random-walk", "-p", "base=conductor", "-o", str(tmp_path / "no.glsl")) == 2
    assert not (tmp_path / "no.glsl").exists()
    assert run("lambert", "-o", f"{tmp_path / 'half'}/", "-o", str(tmp_path)) == 2
    assert not (tmp_path / "half").exists()  # neither of both, where one cannot be


@pytest.mark.sample(2)
@pytest.mark.parametrize("lang", ["glsl", "wgsl", "hlsl"])
@pytest.mark.parametrize("name", ["oren-nayar", "kulla-conty", "mix-of-mixes"])
def test_the_manifest_names_functions_of_its_own_struct(name: str, lang: str) -> None:
    made = written(name, lang)
    struct = made.manifest["struct"]
    for function in made.manifest["functions"].values():
        first = rf"\w+: {struct}\b" if lang == "wgsl" else rf"{struct} \w+"
        assert re.search(rf"\b{function} ?\({first}", made.text), f"{function} of {struct}"


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", FEW)
def test_locals_have_names_of_the_source_and_a_digit_is_a_power(name: str) -> None:
    """Two values of one name are x, x_2: x2 is the square of x. None is named for its operation."""
    for function, body in _functions(written(name).text).items():
        named = re.findall(r"^    \w+ (\w+) = (.*)", body, re.M)
        for local, value in named:
            assert not local.endswith("_") and local not in ("product", "difference", "sum", "holds"), (function, local)
            root = re.fullmatch(r"([a-z]+)2", local)
            if root and root[1] in [other for other, _ in named] and "_" not in local:
                assert value.startswith((f"sqr({root[1]})", f"dot({root[1]}, {root[1]})")), (function, local, value)


def test_copies_for_a_flag_are_named_for_it() -> None:
    functions = _functions(go.emit(go.Dielectric(1.5, 0.3)))
    assert "beta(" in functions["masking_shadowing_transmits"] and "beta(" not in functions["masking_shadowing"]


def test_vectors_stay_vectors() -> None:
    functions = _functions(go.emit(go.KullaConty(go.Conductor.preset("Au", alpha=(0.3, 0.1), rotation=0.5))))
    assert "vec3(alpha * w.xy, w.z)" in functions["stretch"]
    assert "m.xy * (alpha.yx * over)" in functions["GGX_D"]
    assert all(body.count("max(self.alpha") <= 1 for body in functions.values())
    # a parameter that Python gives a new value is given one, and read no more as it was
    turned = functions["Conductor_eval"]
    assert turned.index("half_vector(wo, wi)") < turned.index("wo = rotate(wo, self.rotation);")


def test_values_made_by_small_functions_of_the_source_bear_their_names() -> None:
    assert "bool above = wo.z > 0.0 && wi.z > 0.0;" in _functions(go.emit(GOLD))["Conductor_sample"]


@pytest.mark.sample(3)
@pytest.mark.parametrize("lang", LANGS)
def test_the_head_tells_how_to_call_it_and_structs_what_their_fields_are(lang: str) -> None:
    text = go.emit(go.KullaConty(GOLD), lang)
    head = text.partition("\n\n")[0]
    own = "material" if lang == "wgsl" else "self"
    assert f"// KullaConty_eval({own}, derived, wo, wi)   the BSDF times |cos theta_i|, RGB, 1/sr" in head
    assert f"// KullaConty_derive({own})" in head and "KullaConty_terms" not in head
    assert "not sufficient." in head or lang in ("glsl-vulkan", "osl")  # which have no precision of 16 bits
    assert re.search(r"base_k\b.*// imaginary part of the refractive index, relative to the outside; >= 0", text)
    assert "// width of the microfacet distribution; along x, along y; >= 0 and <= 1" in text
    assert re.search(r"pdf\b.*// density of wi, 1/sr", text)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", FEW)
def test_comments_speak_of_the_shader_not_of_python(name: str) -> None:
    comments = "\n".join(re.findall("//.*", written(name).text))
    for word in (
        "None",
        "NumPy",
        "array",
        "tuple",
        "gonio.",
        "KINDS",
        "recorded",
        "transmits  whether wi",
        "one entry per ray",
    ):
        assert word not in comments, word


def test_every_constant_that_is_no_multiple_of_pi_says_what_it_is() -> None:
    text = go.emit(go.KullaConty(GOLD))
    assert "NOTHING = 1.0e-5;  // smaller values of M_avg" in text


@pytest.mark.slow
def test_the_text_is_the_same_in_every_process_and_for_every_value() -> None:
    names = ["kulla-conty-glass", "mix-compensated", "glass-turned"]
    code = (
        "import sys; sys.path[:0] = ['tests', 'tests/shaders']; import gonio as go; from variants import EVERY;"
        f"sys.stdout.write(''.join(go.emit(EVERY[n], lang) for n in {names} for lang in ('glsl', 'wgsl', 'hlsl')))"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", code],
            cwd=Path(__file__).parents[2],
            env={**os.environ, "PYTHONHASHSEED": seed},
            check=True,
            capture_output=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(texts) == 1


def test_numbers_do_not_shape_the_code() -> None:
    def texts(*materials: go.BSDF) -> set[str]:
        return {go.emit(m) for m in materials}

    assert len(texts(*(go.Conductor(eta=e, k=k, alpha=a) for e, k, a in [(0, 0, 0), (1, 1, 1), (0.2, 3, 1e-4)]))) == 1
    assert len(texts(*(go.Dielectric(eta, a) for eta, a in [(1, 0), (0.5, 0.2), (1.5, 1)]))) == 1
    assert len(texts(*(go.mix(go.Lambert(), go.Phong(), w) for w in (0, 0.5, 1)))) == 1
    assert len(texts(*(go.KullaConty(go.Conductor(alpha=a)) for a in (0, 0.5, 1)))) == 1


@pytest.mark.slow
def test_names_are_legal_in_every_language() -> None:
    """GLSL keeps gl_ and every double underscore for itself, and each language its own words."""
    for lang in LANGS:
        language = languages()[lang]
        for name in ("low-smooth", *(name for name in FEW if name in SHAPES)):
            code = re.sub("//.*", "", written(name, lang).text)
            words = set(re.findall(r"[A-Za-z_]\w*", code))
            assert not [w for w in words if "__" in w or w.startswith(("gl_", "_"))], (lang, name)
            declared = set(re.findall(r"(?:\bfn|\blet|\bvar|\bstruct) (\w+)|^    (?:\w+) (\w+) = ", code, re.M))
            assert not {w for pair in declared for w in pair} & language.reserved, (lang, name)


def test_a_field_by_a_reserved_name_is_the_same_in_shader_and_manifest() -> None:
    class Odd(go.BSDF):
        """A grey surface whose parameters have unlucky names."""

        half: float = go.number(0.5, "share of light that is reflected", low=0.0, high=1.0)
        sample_: float = go.number(0.5, "another")

        def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
            """half times another |cos theta_i| / pi."""
            return ops.where(wo.z * wi.z > 0.0, ops.abs(wi.z) * self.half * self.sample_ * ops.inv_pi, 0.0)

    for lang in LANGS:
        made = bundle(Odd(), lang, ("eval",))
        names = [f["name"] for f in made.manifest["fields"]]
        assert names[0] == ("half" if lang in ("wgsl", "tsl", "osl") else "half_")
        assert all(re.search(rf"\b(?:self|material)\.{name}\b", made.text) for name in names)


def test_comparisons_of_wgsl_have_parentheses_only_where_a_template_could_be_read() -> None:
    text = go.emit(GOLD, "wgsl")
    assert "let is_smooth = material.alpha.x < SMOOTH && material.alpha.y < SMOOTH;" in text

    class Leaning(go.BSDF):
        """A grey surface for light that is not above the view, both on the upper side."""

        def eval(self, wo, wi, mode="radiance"):  # type: ignore[no-untyped-def]
            """|cos theta_i| / pi."""
            lit = (wo.z > 0.0) & ~(wo.z < wi.z)
            return ops.where(lit, ops.abs(wi.z) * ops.inv_pi, 0.0)

    assert "!(wo.z < wi.z)" in bundle(Leaning(), "wgsl", ("eval",)).text  # what is denied keeps them
