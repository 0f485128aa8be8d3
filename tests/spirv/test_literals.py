"""Template literals of JavaScript as data: names, comments, strings, escapes, code inside."""

from pathlib import Path

import pytest
from gonio.errors import InputError
from gonio.spirv import Machine, compile_text, parse
from gonio.spirv.compiler import compiler
from gonio.spirv.literals import array_in, literals, shader_in

TEXT = r"""
// a comment with a ` in it
/* and `one` more */
const quoted = "a ` in a string", other = 'and \' ` here';
export default /* glsl */`
float two() { return 2.0; } // it's GLSL's own: \`, \\ and \${
`;
export const named = `first`, typed: string = `second`;
const made = { shader: `third ${ `inside ${ 1 } }` } end`, plain: `fourth` };
"""


def test_literals_have_their_names_and_lines() -> None:
    found = literals(TEXT, "x.js")
    assert [one.name for one in found] == ["default", "named", "typed", "shader", "plain"]
    assert [one.line for one in found] == [5, 8, 8, 9, 9]
    assert found[0].text == "\nfloat two() { return 2.0; } // it's GLSL's own: `, \\ and ${\n"
    assert [one.code for one in found] == [0, 0, 0, 9, 0]


def test_text_that_is_made_by_code_is_refused() -> None:
    assert shader_in(TEXT, "plain", "x.js").text == "fourth"
    with pytest.raises(InputError, match=r"running JavaScript") as refused:
        shader_in(TEXT, "shader", "x.js")
    assert refused.value.where == "x.js:9"
    with pytest.raises(InputError, match="5 template literals") as several:
        shader_in(TEXT, "", "x.js")
    assert "named, typed" in several.value.hint
    with pytest.raises(InputError, match="0 template literals named missing"):
        shader_in(TEXT, "missing", "x.js")


@pytest.mark.parametrize("text", ["`", "a = `b ${ c", "`${ `${ `", "x = `\\"])
def test_literal_without_an_end_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="is not closed"):
        literals(text, "x.js")


def test_array_of_numbers() -> None:
    assert array_in("const D = new Uint16Array( [\n0x3c00, 1, 2e1,\n] );", "D", "x.js") == (
        "Uint16Array",
        [15360, 1, 20],
    )
    for text in ("D = [1]", "D = new Float32Array([f()])", "E = new Float32Array([1])"):
        with pytest.raises(InputError, match="no array D"):
            array_in(text, "D", "x.js")
    with pytest.raises(InputError, match="D: "):
        array_in("D = new Float32Array([1-2])", "D", "x.js")


def test_shader_includes_text_from_javascript(tmp_path: Path) -> None:
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")
    (tmp_path / "two.glsl.js").write_text(TEXT.partition("export const")[0])
    (tmp_path / "both.js").write_text(
        "const a = `float f() { return 1.0; }`;\nconst b = `\nfloat g() { return h(); }`;\n"
    )
    module = parse(compile_text("#include <two>\n#include <both.js#a>\n", "x.glsl", folders=[tmp_path]))
    assert [Machine(module).call(module.function(name)[0], []) for name in ("two", "f")] == [2.0, 1.0]
    with pytest.raises(InputError) as broken:
        compile_text("#include <both.js#b>\n", "x.glsl", folders=[tmp_path])
    assert str(broken.value.where).endswith("both.js:3")
    with pytest.raises(InputError, match=r"'twice' after an include"):
        compile_text("#include <two> twice\n", "x.glsl", folders=[tmp_path])


@pytest.mark.slow
def test_include_repeats_a_text_per_index_and_renames(tmp_path: Path) -> None:
    """As Babylon.js does: {X} stands for the index."""
    try:
        compiler()
    except Exception as error:
        pytest.skip(f"NOT TRIED: {error}")
    (tmp_path / "lamp.js").write_text("const lamp = `float lamp{X}() { return {X}.0; }`;\n")
    (tmp_path / "named.js").write_text("const named = `float _NAME_() { return 7.0 + OTHER.5; }`;\n")
    text = "#include<lamp>[0..COUNT]\n#include<lamp>[5] // one\n#include<named>(_NAME_,seven,OTHER,0)\n"
    defines = {"COUNT": "2"}
    module = parse(compile_text(text, "x.glsl", folders=[tmp_path], defines=defines))
    names = ("lamp0", "lamp1", "lamp5", "seven")
    assert [Machine(module).call(module.function(name)[0], []) for name in names] == [0.0, 1.0, 5.0, 7.5]
    assert not module.function("lamp2")
    for wrong, words in (
        ("[0..65]", "65 is not a number of repeats"),
        ("[0..MANY]", "MANY is not a number of repeats"),
        ("(a,b,c)", "after an include"),
    ):
        with pytest.raises(InputError, match=words):
            compile_text(f"#include<lamp>{wrong}\n", "x.glsl", folders=[tmp_path])
    (tmp_path / "bomb.js").write_text(f"const bomb = `{'{X}a' * 250_000}`;\n")
    for more in ("[0..64]", f"(a,{'b' * 64})", f"[{'b' * 64}]"):
        with pytest.raises(InputError, match="more than 4 MB"):
            compile_text(f"#include<bomb>{more}\n", "x.glsl", folders=[tmp_path])
