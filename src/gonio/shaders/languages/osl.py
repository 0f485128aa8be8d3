"""OSL, the Open Shading Language of Cycles, Arnold, RenderMan and other renderers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from ..table_files import FORMATS
from .base import Language

# keywords, words that the specification reserves, and the functions and closures of stdosl.h; parameters may shadow the
# global variables P, N, u, v, ...
_RESERVED = """
    and break closure color continue do else emit float for if illuminance illuminate int matrix normal not or output
    point public return string struct vector void while bool case catch char class const delete default double enum
    extern false friend goto inline long new operator private protected short signed sizeof static switch template this
    throw true try typedef uniform union unsigned varying virtual volatile
    backfacing abs acos area arraylength asin atan atan2 attribute blackbody bump calculatenormal cbrt ceil cell
    cellnoise clamp concat cos cosh cross degrees determinant displace distance dict_find dict_next dict_value dot
    Dx Dy Dz endswith
    erf erfc error exit exp exp2 expm1 fabs faceforward filterwidth floor fmod format fprintf fresnel getattribute
    getchar getmatrix getmessage gettextureinfo hash hashnoise hypot inversesqrt isconnected isconstant isfinite isinf
    isnan length linearstep log log10 log2 logb luminance max min mix mod noise normalize pnoise pointcloud_get
    pointcloud_search pointcloud_write pow printf psnoise radians raytype reflect refract regex_match regex_search
    rotate round select setmessage sign sin sincos sinh smooth_linearstep smoothstep snoise spline splineinverse split
    sqrt startswith step stof stoi strlen substr surfacearea tan tanh texture texture3d trace transform transformc
    transformu transpose trunc warning wavelength_color environment
    anisotropic_vdf artistic_ior background burley_diffuse_bsdf chiang_hair_bsdf conductor_bsdf debug
    dielectric_bsdf diffuse emission generalized_schlick_bsdf holdout layer medium_vdf microfacet oren_nayar
    oren_nayar_diffuse_bsdf phong reflection refraction sheen_bsdf subsurface subsurface_bssrdf translucent
    translucent_bsdf transparent transparent_bsdf uniform_edf ward
    vector2 vector4 vec4ToVec3 exponential arc_tangent read_float read_vector2 read_vector4 shader surface
    displacement volume
"""


class OSL(Language):
    """OSL: functions for `#include` in a shader, without global variables; masks are vectors of 0 and 1."""

    name = "osl"
    title = "OSL"
    suffix = ".osl"
    precision = "All numbers are 32-bit floats."
    types: ClassVar[Mapping[str, str]] = {
        "bool": "int",
        "vec2": "vector2",
        "vec3": "vector",
        "vec4": "vector4",
        "bvec3": "vector",
    }
    truth = ("0", "1")
    # renderers compute exp and atan2 with fast approximations, whose errors are up to 232 units in the last place
    # (OpenImageIO, fmath.h); logb of any number and exp2 of an integer are exact
    words: ClassVar[Mapping[str, str]] = {
        **Language.words,
        "exp": "{prefix}exponential({0})",
        "atan2": "{prefix}arc_tangent({0}, {1})",
        "exponent": "logb({0})",
        "scaled": "{0} * exp2({1})",
    }
    compare: ClassVar[Mapping[str, str]] = {  # step(a, b) is b >= a
        "lt": "(1.0 - step({1}, {0}))",
        "le": "step({0}, {1})",
        "gt": "(1.0 - step({0}, {1}))",
        "ge": "step({1}, {0})",
        "eq": "(step({0}, {1}) * step({1}, {0}))",
        "ne": "(1.0 - step({0}, {1}) * step({1}, {0}))",
        "not": "(1.0 - {0})",
    }
    choice = ("{0} ? {1} : {2}", "select({2}, {1}, {0})")
    # the rows of a table are stored twice, the second time in reverse order, so that the same texel is read regardless
    # of which row of an image has t = 0 in a renderer (`table_files.py`)
    helpers: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "exponential": (
            "// e^x = 2^n e^r with |r| <= log(2) / 2, by Taylor series.",
            "float {name}(float x) {{",
            "    float n = clamp(floor(x * 1.442695 + 0.5), -126.0, 127.0);",
            "    float r = x - n * 0.693359375 + n * 0.00021219444;",
            "    float series = 1.0 + r * (1.0 + r * (0.5 + r * (0.16666667 + r * (0.041666668",
            "        + r * (0.008333334 + r * (0.0013888889 + r * 0.0001984127))))));",
            "    return x < -87.3 ? 0.0 : exp2(n) * series;",
            "}}",
            "",
            "vector {name}(vector x) {{",
            "    return vector({name}(x[0]), {name}(x[1]), {name}(x[2]));",
            "}}",
        ),
        "arc_tangent": (
            "// The angle of (x, y), by the polynomial of the Cephes library for |r| <= sqrt(2) - 1.",
            "float {name}(float y, float x) {{",
            "    float high = max(abs(x), abs(y));",
            "    float t = high > 0.0 ? min(abs(x), abs(y)) / high : 0.0;",
            "    int beyond = t > 0.41421356;",
            "    float r = beyond ? (t - 1.0) / (t + 1.0) : t;",
            "    float r2 = r * r;",
            "    float series = ((0.080537446 * r2 - 0.13877686) * r2 + 0.1997771) * r2 - 0.3333295;",
            "    float angle = (beyond ? 0.7853982 : 0.0) + r + r * r2 * series;",
            "    angle = abs(y) > abs(x) ? 1.5707964 - angle : angle;",
            "    angle = x < 0.0 ? 3.1415927 - angle : angle;",
            "    return y < 0.0 ? -angle : angle;",
            "}}",
        ),
        "read_float": (
            "float {name}(string file, int x, int y, int width, int height) {{",
            '    return texture(file, (x + 0.5) / width, 0.5 * (y + 0.5) / height, "interp", "closest");',
            "}}",
        ),
        "read_vector2": (
            "vector2 {name}(string file, int x, int y, int width, int height) {{",
            '    color c = texture(file, (x + 0.5) / width, 0.5 * (y + 0.5) / height, "interp", "closest");',
            "    return vector2(c[0], c[1]);",
            "}}",
        ),
        "read_vector4": (
            "vector4 {name}(string file, int x, int y, int width, int height) {{",
            "    float a = 0.0;",
            "    color c = texture(",
            '        file, (x + 0.5) / width, 0.5 * (y + 0.5) / height, "interp", "closest", "alpha", a);',
            "    return vector4(c[0], c[1], c[2], a);",
            "}}",
        ),
    }
    spreads: ClassVar[Mapping[str, str]] = {"vec2": "{0}({1}, {1})", "vec4": "{0}({1}, {1}, {1}, {1})"}
    reserved = frozenset(_RESERVED.split())
    overloads = False
    parameters_change = False
    struct_literal = False
    array_literal = False
    whole_members = False  # OSL 1.14 compiles such braces to code that aborts
    swizzles = False
    tables = "exr-mirrored"

    def array(self, type_: str, parts: list[str]) -> str:
        return f"{{ {', '.join(parts)} }}"

    def constant(self, name: str, text: str) -> str:
        return f"#define {name} {f'({text})' if text.startswith('-') else text}"

    def values(self, type_: str, name: str, parts: list[str]) -> str:
        return f"{type_} {name}() {{ return {{ {', '.join(parts)} }}; }}"

    def binding(self, name: str, dimension: int, place: int) -> list[str]:
        return [f'#define {name} "{name.replace("table_", "", 1)}{FORMATS[self.tables].suffix}"']

    def texel(self, table: str, places: list[str], channels: int, shape: Sequence[int], prefix: str) -> str:
        kind = {1: "float", 2: "vector2", 4: "vector4"}[channels]
        x, y, *z = places
        width, height, *depth = shape
        row = f"{y} + {height} * ({z[0]})" if z else y
        return f"{prefix}read_{kind}({table}, {x}, {row}, {width}, {height * (depth[0] if depth else 1)})"

    def finished(self, lines: Sequence[str], prefix: str) -> list[str]:
        """The lines, after the OSL headers that declare the types in use."""
        text = "\n".join(line for line in lines if not line.lstrip().startswith("//"))
        headers = [f'#include "{name}.h"' for name in ("vector2", "vector4") if f"{name}" in text]
        return [*headers, "", *lines] if headers else list(lines)
