"""Modules whose types and names lie: each is one clear InputError."""

import struct
from collections.abc import Callable
from pathlib import Path

import gonio as go
import pytest
from gonio.errors import InputError
from gonio.spirv import Machine, parse

FLOAT, VECTOR, POINTER, VARIABLE, FUNCTION_TYPE, FUNCTION, A, B, LABEL, SUM, VOID = range(1, 12)
Words = list[tuple[int, ...]]


def _name(id: int, text: str) -> tuple[int, ...]:
    data = text.encode() + b"\0" * (4 - len(text.encode()) % 4)
    return (5, id, *struct.unpack(f"<{len(data) // 4}I", data))


def _module(change: Callable[[Words], None] = lambda _: None, name: str = "rough") -> bytes:
    """uniform float NAME; float brdf(vec3 L, vec3 V) { return NAME + NAME; }"""
    code: Words = [
        _name(VARIABLE, name), _name(FUNCTION, "brdf"), _name(A, "L"), _name(B, "V"),
        (22, FLOAT, 32), (23, VECTOR, FLOAT, 3), (32, POINTER, 0, FLOAT),
        (33, FUNCTION_TYPE, FLOAT, VECTOR, VECTOR), (59, POINTER, VARIABLE, 0),
        (54, FLOAT, FUNCTION, 0, FUNCTION_TYPE), (55, VECTOR, A), (55, VECTOR, B), (248, LABEL),
        (61, FLOAT, 20, VARIABLE), (129, FLOAT, SUM, 20, 20), (254, SUM), (56,),
    ]  # fmt: skip
    change(code)
    words = [0x07230203, 0x10000, 0, 100, 0]
    for opcode, *operands in code:
        words += [(len(operands) + 1) << 16 | opcode, *operands]
    return struct.pack(f"<{len(words)}I", *words)


def _shader(folder: Path, data: bytes) -> object:
    file = folder / "a.spv"
    file.write_bytes(data)
    return go.Shader(str(file))


def _replace(old: tuple[int, ...], *new: tuple[int, ...]) -> Callable[[Words], None]:
    def change(code: Words) -> None:
        at = code.index(old)
        code[at : at + 1] = new

    return change


def test_the_module_itself_is_read(tmp_path: Path) -> None:
    assert list(type(_shader(tmp_path, _module())).parameters()) == ["rough"]  # type: ignore[attr-defined]


def test_a_variable_whose_type_is_no_pointer(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a variable of id 4 whose type is no pointer"):
        _shader(tmp_path, _module(_replace((59, POINTER, VARIABLE, 0), (59, FLOAT, VARIABLE, 0))))


def test_a_pointer_in_place_of_a_number(tmp_path: Path) -> None:
    for sum in ((129, FLOAT, SUM, VARIABLE, 20), (83, FLOAT, SUM, VARIABLE)):
        with pytest.raises(InputError, match="a pointer in place of a number") as caught:
            _shader(tmp_path, _module(_replace((129, FLOAT, SUM, 20, 20), sum)))
        assert ".py" not in str(caught.value)


def test_types_that_contain_themselves() -> None:
    with pytest.raises(InputError, match="two types of id 1"):
        parse(_module(_replace((32, POINTER, 0, FLOAT), (30, 50, FLOAT), (30, FLOAT, 50), (32, POINTER, 0, 50))))
    with pytest.raises(InputError, match="whose type is no pointer"):
        parse(_module(_replace((32, POINTER, 0, FLOAT), (32, POINTER, 0, POINTER))))


def test_a_name_that_is_none_is_rejected(tmp_path: Path) -> None:
    """Parameters become arguments of a method, whose text the standard library compiles."""
    for name in ("a=print(1),b", "", "a b", "a\n", "1"):
        with pytest.raises(InputError, match="cannot be the name of a parameter"):
            _shader(tmp_path, _module(name=name))


def test_names_that_begin_with_underscores(tmp_path: Path) -> None:
    for name, field in (("_class", "class_"), ("__sample", "sample_"), ("_rough", "rough")):
        shader = _shader(tmp_path, _module(name=name))
        assert list(type(shader).parameters()) == [field]  # type: ignore[attr-defined]


def test_meanings_that_a_function_is_not_given(tmp_path: Path) -> None:
    """`albedo` is called for a view alone."""
    (tmp_path / "a.spv.toml").write_text('function = "brdf"\nalbedo = "brdf"\nalbedo_arguments = ["light", "view"]')
    with pytest.raises(InputError, match="'light' given for an argument of a function without 'light'"):
        _shader(tmp_path, _module())


@pytest.mark.slow
def test_a_variable_that_is_stored_into_its_parts_stays_bounded() -> None:
    def change(code: Words) -> None:
        pointer, part, integer = 60, 65, 66
        at = code.index((61, FLOAT, 20, VARIABLE))
        grown: Words = [(59, pointer, 61, 7)]
        for number in range(100, 204, 4):
            grown.append((61, VECTOR, number, 61))
            for place in (1, 2, 3):
                grown += [(65, part, number + place, 61, 61 + place), (62, number + place, number)]
        code[at:at] = [*grown, (61, VECTOR, 301, 61), (129, VECTOR, 302, 301, 301)]
        at = code.index((33, FUNCTION_TYPE, FLOAT, VECTOR, VECTOR))
        constants = [(43, integer, 62 + place, place) for place in range(3)]
        code[at:at] = [(32, pointer, 7, VECTOR), (32, part, 7, FLOAT), (21, integer, 32, 1), *constants]

    module = parse(_module(change))
    with pytest.raises(InputError, match="more than 65536 numbers"):
        Machine(module).call(module.function("brdf")[0], [(0.0, 0.0, 1.0)] * 2)
