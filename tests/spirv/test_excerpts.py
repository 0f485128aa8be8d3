"""Single functions out of files that do not compile by themselves."""

import re
from pathlib import Path

import gonio as go
import numpy as np
import pytest
from gonio.errors import InputError
from gonio.spirv.excerpts import functions_in

TEXT = """layout(set = 0) restrict buffer Lights { LightData data[]; } lights; // { of the renderer
#CODE : LIGHT
float twice(float x);
float twice(float x) {
    // a brace } in a comment; and /* another { */
    if (x > 0.0) { return 2.0 * x; }
    return 0.0;
}
vec2 twice(
#ifdef WIDE
    vec4 more,
#endif
    vec2 x) { return 2.0 * x; }
float unknown() { return lights.data[0].power; }
highp float half_of(float x)
{
    return 0.5 * x;
}
"""


def test_functions_keep_their_text_and_lines() -> None:
    text, line = functions_in(TEXT, "twice,half_of", "file.glsl")
    assert line == 4 and "unknown" not in text and "CODE" not in text and "float twice(float x);" not in text
    for name in ("if (x > 0.0)", "vec4 more", "return 0.5 * x;"):
        place = TEXT.count("\n", 0, TEXT.index(name)) + 1
        assert text.count("\n", 0, text.index(name)) + line == place, name


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        (TEXT, "missing", "no function 'missing' is defined here"),
        (TEXT, "twice,", "'' is not a function name"),
        (TEXT, "a b", "'a b' is not a function name"),
        ("float open(float x) { return x;", "open", "no function 'open'"),
        ("float declared(float x);", "declared", "no function 'declared'"),
    ],
)
def test_other_names_are_rejected(text: str, name: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as error:
        functions_in(text, name, "file.glsl")
    assert error.value.where == "file.glsl"


def test_include_takes_a_function_and_messages_keep_its_line(tmp_path: Path) -> None:
    (tmp_path / "engine.glsl").write_text(TEXT)
    own = "#include <engine.glsl#half_of>\nvec3 brdf(vec3 light, vec3 view) { return vec3(half_of(light.z)); }\n"
    (tmp_path / "own.glsl").write_text(own)
    wi = np.array([[0.6, 0.0, 0.8]])
    settings = {"includes": ["."], "function": "brdf", "arguments": ["light", "view"], "cosine": True}
    toml = "\n".join(
        f"{key} = {str(value).lower() if isinstance(value, bool) else repr(value)}" for key, value in settings.items()
    )
    (tmp_path / "own.glsl.toml").write_text(toml)
    assert go.Shader(tmp_path / "own.glsl").eval(wi, wi, precision="float64")[0, 0] == pytest.approx(0.4)
    (tmp_path / "engine.glsl").write_text(TEXT.replace("0.5 * x", "0.5 * y"))
    with pytest.raises(InputError, match="'y'") as error:
        go.Shader(tmp_path / "own.glsl")
    assert str(error.value.where).endswith(f"engine.glsl:{TEXT[: TEXT.index('0.5 * x')].count(chr(10)) + 1}")
