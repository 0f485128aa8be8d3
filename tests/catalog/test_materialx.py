"""MaterialX: the parameters of its surfaces, both ways, and documents that are damaged or mean harm."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio.catalog import documents
from gonio.catalog.documents import Described, Document, materialx
from gonio.errors import InputError, MachineError

HEAD = '<?xml version="1.0"?>\n<materialx version="1.39">'
PAINT = f"""{HEAD}
  <open_pbr_surface name="S" type="surfaceshader">
    <input name="base_color" type="color3" value="0.1, 0.2, 0.3" />
    <input name="specular_roughness" type="float" value="0.25" />
    <input name="geometry_thin_walled" type="boolean" value="true" />
  </open_pbr_surface>
  <surfacematerial name="Paint" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="S" />
  </surfacematerial>
</materialx>
"""
STANDARD = f"""{HEAD}
  <standard_surface name="Car" type="surfaceshader">
    <input name="base_color" type="color3" value="0.8, 0.4, 0.2" />
    <input name="coat" type="float" value="0.5" />
    <input name="coat_color" type="color3" value="1, 0.5, 0" />
    <input name="specular_rotation" type="float" value="0.25" />
  </standard_surface>
</materialx>
"""


def read(folder: Path, text: str, name: str = "") -> Described:
    (folder / "a.mtlx").write_text(text)
    return documents.read(Document.family.get("materialx"), folder / "a.mtlx", name)


if importlib.util.find_spec("MaterialX"):

    def test_an_open_pbr_surface_keeps_its_names_and_values(tmp_path: Path) -> None:
        values = {"base_color": [pytest.approx(c) for c in (0.1, 0.2, 0.3)], "specular_roughness": 0.25}
        expected = {"type": "openpbr", **values, "geometry_thin_walled": True}
        assert read(tmp_path, PAINT, "Paint") == (expected, ())

    def test_a_standard_surface_is_translated_with_its_defaults(tmp_path: Path) -> None:
        found, notices = read(tmp_path, STANDARD)
        assert found["base_color"] == pytest.approx([0.8, 0.4 * 0.75, 0.2 * 0.5])
        assert [found[key] for key in ("base_weight", "specular_roughness", "coat_weight")] == [1.0, 0.2, 0.5]
        assert found["fuzz_roughness"] == pytest.approx(0.3**0.4)
        assert notices == ("specular_rotation is omitted",)
        old = STANDARD.replace('surfaceshader"', 'surfaceshader" version="1.0.0"', 1)
        assert read(tmp_path, old).notation["base_weight"] == 0.8

    def test_the_translation_is_that_of_materialx_own_node_graph() -> None:
        """Its nodes are computed one by one, over random inputs and those that switch."""
        import MaterialX as mx

        library = mx.createDocument()
        folder = Path(mx.__file__).parent / "libraries"
        mx.readFromXmlFile(library, str(folder / "bxdf/translation/standard_surface_to_open_pbr.mtlx"))
        graph = library.getNodeGraph("NG_standard_surface_to_open_pbr_surface")
        rng = np.random.default_rng(1)
        for case in range(40):
            inputs = {}
            for key, default in materialx._defaults("ND_standard_surface_surfaceshader").items():
                value = np.round(rng.random(np.shape(default)), 3) * (rng.random() < 0.7)
                inputs[key] = default if isinstance(default, bool) else tuple(value) if value.ndim else float(value)
            if case % 2:
                inputs["metalness"] = 0.0
            found = materialx.to_open_pbr(inputs)
            outputs = graph.getOutputs()
            assert {one.getName().removesuffix("_out") for one in outputs} == set(found)
            for one in outputs:
                key = one.getName().removesuffix("_out")
                assert np.asarray(found[key], float) == pytest.approx(computed(graph, one.getNodeName(), inputs)), key

    def computed(graph: Any, name: str, given: dict[str, Any]) -> Any:
        """A node's value."""
        node = graph.getNode(name)

        def of(key: str) -> Any:
            one = node.getInput(key)
            if one.getInterfaceName():
                return np.asarray(given[one.getInterfaceName()], float)
            if one.getNodeName():
                return computed(graph, one.getNodeName(), given)
            value = one.getValue()
            return np.asarray(value if isinstance(value, int | float) else tuple(value), float)

        kind = node.getCategory()
        if kind in ("dot", "convert"):
            return of("in")
        if kind == "extract":
            return of("in")[int(of("index"))]
        if kind == "mix":
            return of("bg") * (1.0 - of("mix")) + of("fg") * of("mix")
        if kind in ("ifgreater", "ifequal"):
            holds = of("value1") > of("value2") if kind == "ifgreater" else of("value1") == of("value2")
            return of("in1") if holds else of("in2")
        both = {"multiply": np.multiply, "dotproduct": np.dot, "power": np.power}
        return both[kind](of("in1"), of("in2"))

    def test_what_is_written_is_read_again(tmp_path: Path) -> None:
        values = {"base_color": [0.1, 0.2, 0.3], "coat_weight": 0.5, "geometry_thin_walled": True}
        (tmp_path / "paint.json").write_text(json.dumps({"type": "openpbr", **values}))
        assert documents.convert(str(tmp_path / "paint.json"), tmp_path / "paint.mtlx") == ()
        documents.convert(str(tmp_path / "paint.mtlx:paint"), tmp_path / "again.json")
        again = json.loads((tmp_path / "again.json").read_text())
        assert again == {
            "type": "gonio-openpbr",
            **values,
            "base_color": [pytest.approx(c) for c in values["base_color"]],
        }

    def test_an_openpbr_given_as_text_is_written(tmp_path: Path) -> None:
        text = "openpbr(base_metalness=1,base_color=1,.75,.5,specular_roughness=.5)"
        go.convert(text, tmp_path / "gold.mtlx")
        assert go.material(tmp_path / "gold.mtlx") == go.material(text)

    def test_a_material_that_the_format_does_not_hold_is_not_written(tmp_path: Path) -> None:
        (tmp_path / "a.json").write_text('{"type": "conductor", "alpha": 0.3}')
        with pytest.raises(InputError, match="a conductor given, but materialx files hold openpbr"):
            documents.convert(str(tmp_path / "a.json"), tmp_path / "a.mtlx")
        (tmp_path / "b.json").write_text('{"type": "openpbr", "alpha": 0.3}')
        with pytest.raises(InputError, match="has no input 'alpha'"):
            documents.convert(str(tmp_path / "b.json"), tmp_path / "a.mtlx")
        assert not (tmp_path / "a.mtlx").exists()

    def including(file: str) -> str:
        return f'{HEAD}<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="{file}"/></materialx>'

    def given(name: str, kind: str, value: str) -> str:
        return surface(f'<input name="{name}" type="{kind}" {value}/>')

    def surface(body: str, kind: str = "open_pbr_surface") -> str:
        return f'{HEAD}<{kind} name="S" type="surfaceshader">{body}</{kind}></materialx>'

    LAUGHS = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 12))
    BAD = {
        "unknown surface": (surface("", "gold_leaf"), "unknown node 'gold_leaf'"),
        "unknown input": (given("base_colour", "color3", 'value="1,1,1"'), "no input 'base_colour'"),
        "a picture": (given("base_color", "color3", 'nodename="tiles"'), "its base_color is connected to 'tiles'"),
        "a graph": (given("base_color", "color3", 'nodegraph="G" output="o"'), "its base_color is connected to 'G'"),
        "another type": (given("base_color", "float", 'value="1"'), "of type float, color3 expected"),
        "no number": (given("base_weight", "float", 'value="red"'), "base_weight = 'red' is not of type float"),
        "no value": (given("base_weight", "float", ""), "base_weight = '' is not of type float"),
        "not finite": (given("base_weight", "float", 'value="1e999"'), "base_weight = '1e999' is not"),
        "of itself": (including("a.mtlx"), "which includes it again"),
        "outside": (including("../b.mtlx"), "is outside its folder"),
        "a million nodes": (HEAD + "<a/>" * 1_000_000 + "</materialx>", "more than 100000 elements"),
        "deep": (HEAD + "<a>" * 100_000 + "</a>" * 100_000 + "</materialx>", "more than 64 nested elements"),
        "laughs": (f'<!DOCTYPE m [<!ENTITY l0 "ha">{LAUGHS}]><materialx>&l11;</materialx>', "declares a document type"),
        "a file": ('<!DOCTYPE m [<!ENTITY x SYSTEM "/etc/passwd">]><materialx>&x;</materialx>', "declares a document"),
        "cut off": (PAINT[:200], "not well-formed"),
        "another language": ("<scene/>", "<scene> is not a MaterialX document"),
        "nothing to read": (f"{HEAD}</materialx>", "it contains no material"),
    }

    @pytest.mark.parametrize("name", BAD)
    def test_a_bad_document_is_one_clear_error(tmp_path: Path, name: str) -> None:
        text, says = BAD[name]
        with pytest.raises(InputError, match=says):
            read(tmp_path, text)

    def test_includes_in_a_circle_are_found_and_others_are_followed(tmp_path: Path) -> None:
        include = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="%s.mtlx"/>'
        (tmp_path / "b.mtlx").write_text(PAINT)
        assert read(tmp_path, HEAD + include % "b" + "</materialx>").notation["specular_roughness"] == 0.25
        (tmp_path / "b.mtlx").write_text(HEAD + include % "c" + "</materialx>")
        (tmp_path / "c.mtlx").write_text(HEAD + include % "b" + "</materialx>")
        with pytest.raises(InputError, match="which includes it again"):
            read(tmp_path, HEAD + include % "b" + "</materialx>")

else:

    def test_without_the_wheel_the_error_says_what_to_install(tmp_path: Path) -> None:
        """Nothing of MaterialX is tried where its wheel is missing."""
        with pytest.raises(MachineError, match="needs the package MaterialX") as caught:
            read(tmp_path, PAINT)
        assert caught.value.hint == "pip install 'gonio[materialx]'"
        with pytest.raises(MachineError):
            go.material(str(tmp_path / "a.mtlx"))
