"""GLSL ES 3.00, the language of WebGL2."""

from __future__ import annotations

from .dialect import Dialect

TYPES = {"bvec2": "bvec2", "bvec3": "bvec3"}

WORDS = {
    "sqrt": "sqrt({0})",
    "abs": "abs({0})",
    "minimum": "min({0}, {1})",
    "maximum": "max({0}, {1})",
    "exp": "exp({0})",
    "log": "log({0})",
    "sin": "sin({0})",
    "cos": "cos({0})",
    "atan2": "atan({0}, {1})",
    "floor": "floor({0})",
    "dot": "dot({0}, {1})",
    "any": "any({0})",
}

COMPARE = {
    "lt": "lessThan({0}, {1})",
    "le": "lessThanEqual({0}, {1})",
    "gt": "greaterThan({0}, {1})",
    "ge": "greaterThanEqual({0}, {1})",
    "eq": "equal({0}, {1})",
    "ne": "notEqual({0}, {1})",
    "not": "not({0})",
}

RESERVED = frozenset(
    """attribute const uniform varying layout centroid flat smooth break continue do for while switch case default if
    else in out inout float int void bool true false invariant discard return mat2 mat3 mat4 vec2 vec3 vec4 ivec2
    ivec3 ivec4 bvec2 bvec3 bvec4 uint lowp mediump highp precision sampler2D sampler3D samplerCube struct coherent
    volatile restrict readonly writeonly resource atomic_uint noperspective patch sample subroutine common partition
    active asm class union enum typedef template this goto inline noinline public static extern external interface
    long short double half fixed unsigned superp input output filter sizeof cast namespace using main
    radians degrees sin cos tan asin acos atan pow exp log exp2 log2 sqrt inversesqrt abs sign floor trunc round ceil
    fract mod modf min max clamp mix step smoothstep isnan isinf length distance dot cross normalize reflect refract
    transpose inverse outerProduct determinant texture any all not equal""".split()
)


def _signature(result: str, name: str, parameters: list[tuple[str, str]]) -> str:
    return f"{result} {name}({', '.join(f'{type_} {p}' for type_, p in parameters)}) {{"


def _local(type_: str, name: str, text: str, changes: bool) -> str:
    return f"{type_} {name} = {text};"


def _constant(name: str, text: str) -> str:
    return f"const float {name} = {text};"


def _struct(name: str, fields: list[tuple[str, str]]) -> list[str]:
    return [f"struct {name} {{", *(f"    {type_} {field};" for type_, field in fields), "};"]


def _binding(name: str, dimension: int, place: int) -> list[str]:
    return [f"uniform highp sampler{dimension}D {name};"]


def _lookup(name: str, table: str, channels: int, groups: int, shape: tuple[int, ...]) -> list[str]:
    """A reader of a table: linear in each axis between texel centres."""
    type_, swizzle = {1: ("float", ".r"), 2: ("vec2", ".rg"), 4: ("vec4", "")}[channels]
    arguments = (
        ["float " + axis for axis in "xyz"[-len(shape) :]] if len(shape) < 3 else ["float x", "float y", "float z"]
    )
    names = [a.split()[1] for a in arguments]
    many = groups > 1
    head = f"{type_} {name}({', '.join(arguments + ['int group'] * many)}) {{"
    lines = [head]
    for axis, count in zip(names, shape, strict=True):
        lines.append(f"    float at_{axis} = clamp({axis} * {count}.0 - 0.5, 0.0, {count - 1}.0);")
        lines.append(f"    int {axis}0 = min(int(at_{axis}), {max(count - 2, 0)});")
        lines.append(f"    float t_{axis} = at_{axis} - float({axis}0);")

    def texel(steps: dict[str, int]) -> str:
        where = [f"{axis}0" + (" + 1" if steps[axis] and shape[names.index(axis)] > 1 else "") for axis in names]
        where.reverse()
        if many and len(shape) == 3:
            where[2] = f"group * {shape[0]} + {where[2]}"
        elif many:
            where.append("group")
        elif len(where) == 1:
            where.append("0")
        return f"texelFetch({table}, ivec{len(where)}({', '.join(where)}), 0){swizzle}"

    def between(rest: list[str], steps: dict[str, int], indent: str) -> str:
        if not rest:
            return indent + texel(steps)
        axis, *others = rest
        low, high = (between(others, {**steps, axis: s}, indent + "    ") for s in (0, 1))
        return f"{indent}mix(\n{low},\n{high},\n{indent}    t_{axis})"

    text = between(names, {}, "    ").strip()
    return [*lines, *f"    return {text};".splitlines(), "}"]


GLSL = Dialect(
    name="glsl",
    suffix=".glsl",
    types=TYPES,
    words=WORDS,
    compare=COMPARE,
    choice=("{0} ? {1} : {2}", "mix({2}, {1}, {0})"),
    splat=True,
    overloads=True,
    struct_literal=True,
    reserved=RESERVED,
    signature=_signature,
    local=_local,
    constant=_constant,
    struct=_struct,
    binding=_binding,
    lookup=_lookup,
)
