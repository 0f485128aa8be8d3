"""Whatever Python programs hand over, the answer is a result or one clear error: never a traceback, never no end."""

from __future__ import annotations

from collections.abc import Callable

import gonio as go
import numpy as np
import pytest
from gonio import arguments, emit, render, verify
from gonio.errors import InputError
from gonio.pictures import images
from gonio.scene.film_size import check_film

W = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
NAN = float("nan")
HOSTILE: list[object] = [
    NAN, float("inf"), -1, 2.5, "4", "", None, True, [], [[1, 2], [3]], 1 + 2j, np.array([]), np.array([1 + 1j, 2.0]),
    {}, object(), "a\udcff", "a\0b", 10**30, (1, 2, 3), np.full(3, NAN), b"x", np.array([["a"]]), len,
]  # fmt: skip
GOLD = go.Conductor.preset("Au", alpha=0.2)
PICTURE = np.ones((4, 4, 3), np.float32)


def given(value: object) -> str:
    return type(value).__name__  # without addresses: pytest's processes must agree on names


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"spp": NAN}, "nan given, a whole number expected"),
        ({"spp": 2.5}, "2.5 given, a whole number"),
        ({"spp": "4"}, "'4' given, a whole number"),
        ({"spp": True}, "True given"),
        ({"spp": 10**30}, "samples per pixel"),
        ({"size": (640,)}, "2 whole numbers expected"),
        ({"size": (1, 60_000_000)}, "larger than 65536 pixels"),
        ({"timeout": NAN}, "a number expected"),
        ({"exposure": NAN}, "exposure"),
        ({"denoise": "no"}, "True or False expected"),
        ({"output": "a\0.png"}, "a string or a path expected"),
    ],
)
def test_a_render_asks_for_what_its_annotations_say(arguments: dict[str, object], text: str) -> None:
    with pytest.raises(InputError, match=text):
        render(go.Lambert(), **arguments)  # type: ignore[arg-type]


def test_whole_numbers_of_numpy_serve() -> None:
    assert render(go.Lambert(), spp=np.int64(1), size=np.array([3, 2]), integrator="normal").shape == (2, 3, 3)  # type: ignore[arg-type]


# Of each, one argument after the other is something else; the others are these, which are refused before much is done.
CALLS: dict[str, tuple[Callable[..., object], dict[str, object]]] = {
    "render": (render, {"scene": go.Lambert(), "integrator": "none", "size": (0, 0)}),
    "bake": (go.bake, {"target": "gxg"}),
    "compare": (go.compare, {"test": PICTURE, "reference": PICTURE}),
    "study": (go.study, {"scene": "nowhere", "vary": {}}),
    "verify": (verify, {"target": go.Lambert(), "law": "none", "isolated": False}),
    "emit": (emit, {"model": go.Lambert(), "lang": "glls"}),
    "albedo": (go.albedo, {"model": go.Lambert(), "method": "none"}),
}


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("value", HOSTILE, ids=given)
def test_no_argument_is_a_traceback(name: str, value: object) -> None:
    import inspect

    call, usual = CALLS[name]
    for parameter in inspect.signature(call).parameters:
        if parameter == "law" and value is None:
            continue  # all laws: that is right, and takes long
        try:
            call(**{**usual, parameter: value})
        except InputError as error:
            str(error).encode()  # can be printed anywhere


@pytest.mark.parametrize("value", HOSTILE, ids=given)
def test_no_direction_or_parameter_is_a_traceback(value: object) -> None:
    for call in (
        lambda: GOLD.eval(value, W),  # type: ignore[arg-type]
        lambda: GOLD.pdf(W, value),  # type: ignore[arg-type]
        lambda: GOLD.sample(W, value),  # type: ignore[arg-type]
        lambda: GOLD.eval(W, W, value),  # type: ignore[arg-type]
        lambda: GOLD.eval(W, W, precision=value),  # type: ignore[arg-type]
        lambda: go.Conductor(eta=value, k=3.0),  # type: ignore[arg-type]
        lambda: go.Conductor(eta=0.2, k=3.0, alpha=value),  # type: ignore[arg-type]
        lambda: go.Conductor(eta=0.2, k=3.0, alpha=(value, 0.2)),  # type: ignore[arg-type]
        lambda: go.Conductor(eta=0.2, k=3.0, masking=value),  # type: ignore[arg-type]
        lambda: go.Conductor.preset(value),  # type: ignore[arg-type]
        lambda: go.Mix(go.Lambert(), value, 0.5),  # type: ignore[arg-type]
        lambda: go.set_precision(value),  # type: ignore[arg-type]
    ):
        try:
            call()
        except InputError as error:
            str(error).encode()
        go.set_precision("float32")


def test_directions_and_random_numbers_that_are_none_are_refused() -> None:
    with pytest.raises(InputError, match="length 0"):
        GOLD.sample([0.0, 0.0, 0.0], [0.5, 0.5, 0.5])
    with pytest.raises(InputError, match="length nan"):
        GOLD.eval(W, [NAN, 0.0, 1.0])
    with pytest.raises(InputError, match=r"outside \[0, 1\]"):
        GOLD.sample(W, np.full((2, 3), NAN))
    with pytest.raises(InputError, match="complex"):
        GOLD.eval(W + 0j, W)
    with pytest.raises(InputError, match="empty array"):
        go.Conductor(eta=0.2, k=3.0, alpha=np.array([]))
    with pytest.raises(InputError, match="a number or an array expected"):
        go.Lambert([[0.1, 0.2], [0.3]])  # type: ignore[arg-type]


def test_a_film_is_as_long_as_a_side_may_be() -> None:
    check_film((65536, 1), "size")
    with pytest.raises(InputError, match="larger than"):
        check_film((1, 65537), "size")


def test_annotations_that_are_not_known_are_left_to_the_function() -> None:
    @arguments.checked
    def call(a: dict[int, set[str]], *more: float, size: tuple[int, ...] = (1,)) -> object:
        return a, more, size

    assert call("anything", 1, 2.5, size=[np.int8(3)]) == ("anything", (1, 2.5), [3])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="call: more"):
        call({}, "1")  # type: ignore[arg-type]


def test_pictures_of_complex_numbers_are_refused() -> None:
    with pytest.raises(InputError, match="array of numbers"):
        go.compare(PICTURE + 1j, PICTURE)
    with pytest.raises(InputError):
        images.write("a.exr", PICTURE + 1j)  # type: ignore[arg-type]
