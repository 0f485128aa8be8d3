"""The recorder: what it keeps, and what it refuses with file and line."""

from __future__ import annotations

from typing import Any

import gonio as go
import numpy as np
import pytest
from gonio import ops
from gonio.ops import RecordingError, record


def test_recorded_expression_computes() -> None:
    graph = record(lambda a, b: ops.sqrt(a * a + b * b), a="float", b="float")
    assert graph.evaluate(a=np.array([3.0]), b=np.array([4.0])) == pytest.approx([5.0])


def test_channels_are_recorded_where_the_color_or_a_channel_is() -> None:
    of_color = record(lambda c: ops.of_channels(c, [0.25, 0.5, 1.0]), types={"c": "spectrum"})
    of_channel = record(lambda x: ops.of_channels(np.ones(3), [x, 2.0 * x, 1.0]), types={"x": "float"})
    assert of_color.evaluate(c=np.ones((1, 3))).ravel() == pytest.approx([0.25, 0.5, 1.0])
    assert of_channel.evaluate(x=np.array([0.25])).ravel() == pytest.approx([0.25, 0.5, 1.0])


def test_every_word_records_and_computes_as_in_numpy() -> None:
    def words(x: Any, v: Any, w: Any, c: Any) -> Any:
        return (
            ops.exp(-x) + ops.log(1.0 + x) + ops.floor(3.0 * x) + ops.abs(0.5 - x) + ops.erf(x),
            ops.sin(x) + ops.cos(x) + ops.atan2(x, 1.0 - x) + ops.copysign(x, x - 0.5) + ops.pow(x, 2.5),
            ops.clamp(x, 0.2, 0.8) + ops.minimum(x, 0.5) + ops.maximum(0.5, x) + ops.sqr(x),
            ops.safe_sqrt(x - 0.5) + ops.safe_div(x, ops.floor(x + 0.5)),
            ops.where((x > 0.3) & ~(x >= 0.7) | (x == 0.9), 1.0, -x),
            ops.dot(v, w) + ops.norm(v) + ops.normalize(v).x,
            v * x + w / 2.0 - 1.0,
            ops.vec2(x, 1.0).y + ops.vec3(x, 0.0, 1.0).z,
            ops.mean(c) + ops.max_component(c * 2.0),
            ops.isfinite(1.0 / (x - x)),
        )

    kinds = {"x": "float", "v": "vec3", "w": "vec3", "c": "spectrum"}
    graph = record(words, types=kinds)
    rng = np.random.default_rng(1)
    x = np.concatenate([rng.random(200), [0.3, 0.5, 0.7, 0.9]])
    v, w, c = (rng.normal(size=(3, len(x))) for _ in range(3))
    kind = ops.backend.types("float64")

    def vector(rows: np.ndarray) -> Any:
        return kind.vec3(*[kind.float(np.ascontiguousarray(row)) for row in rows])

    computed = words(kind.float(x), vector(v), vector(w), vector(c))
    for r, d in zip(graph.evaluate(x=x, v=v, w=w, c=c), computed, strict=True):
        np.testing.assert_allclose(r * 1.0, np.broadcast_to(d.numpy(), np.shape(r)) * 1.0, rtol=1e-13, atol=1e-15)


def test_python_if_on_a_value_is_refused_with_file_and_line() -> None:
    class Branching(go.BSDF):
        def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
            if wo.z > 0.0:
                return wi.z
            return 0.0 * wi.z

    with pytest.raises(RecordingError, match=r"(?s)test_recorder\.py:\d+: .*`if`.*where\(mask"):
        Branching().record("eval")


@pytest.mark.parametrize("word", ["and", "or", "not"])
def test_python_logic_on_a_value_is_refused(word: str) -> None:
    logic = {"and": lambda a: (a > 0) and (a < 1), "or": lambda a: (a > 0) or (a < 1), "not": lambda a: not (a > 0)}
    with pytest.raises(RecordingError, match="use where"):
        record(logic[word], a="float")


def test_closure_over_an_outer_value_is_refused() -> None:
    def outer(a: Any) -> Any:
        @ops.function
        def inner(b: Any) -> Any:
            return b * a  # a is outer's

        return inner(a + 1.0)

    with pytest.raises(RecordingError, match=r"(?s)a value of 'outer' is used inside 'inner'.*pass it as an argument"):
        record(outer, a="float")


def test_value_that_outlives_its_recording_is_refused() -> None:
    kept = []
    record(lambda a: kept.append(a + 1.0) or a, a="float")
    with pytest.raises(RecordingError, match="used after its recording"):
        kept[0] + 1.0


def test_mixing_vectors_of_different_sizes_is_refused() -> None:
    with pytest.raises(RecordingError, match="mixes vec2 and vec3"):
        record(lambda a, b: a + b, a="vec2", b="vec3")


def test_array_inside_recorded_code_is_refused() -> None:
    with pytest.raises(RecordingError, match="ndarray in recorded code"):
        record(lambda a: a + np.ones(3), a="float")


def test_unknown_component_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="a vec2 has no 'z'"):
        record(lambda a: a.z, a="vec2")


def test_function_is_recorded_once_for_each_combination_of_types() -> None:
    @ops.function
    def twice(a: Any) -> Any:
        """Two times a."""
        return a * 2.0

    def outer(a: Any, v: Any) -> Any:
        return twice(a) + twice(a + 1.0), twice(v)

    graph = record(outer, a="float", v="vec3")
    assert [f.name for f in graph.functions] == ["twice", "twice_2", "outer"]
    assert [f.doc for f in graph.functions[:2]] == ["Two times a."] * 2
    a, v = graph.evaluate(a=np.array([1.0]), v=np.ones((3, 1)))
    assert a == pytest.approx([6.0]) and np.all(v == 2.0)


def test_function_that_differs_in_a_constant_is_recorded_apart() -> None:
    @ops.function
    def scaled(a: Any, by: float) -> Any:
        return a * by

    graph = record(lambda a: scaled(a, 2.0) + scaled(a, 3.0), a="float")
    assert graph.evaluate(a=np.array([1.0])) == pytest.approx([5.0])


def test_constants_true_and_one_are_not_taken_for_each_other() -> None:
    @ops.function
    def chosen(a: Any, how: Any) -> Any:
        return a * 10.0 if how is True else a

    graph = record(lambda a: chosen(a, True) + chosen(a, 1), a="float")
    assert graph.evaluate(a=np.array([1.0])) == pytest.approx([11.0])


def test_a_graph_is_printed_a_value_a_line() -> None:
    graph = ops.record(lambda a, b: ops.sqrt(a * a + b.z), a="float", b="vec3")
    lines = [" ".join(line.split()) for line in str(graph).splitlines()]
    assert lines[0].endswith("(a: float, b: vec3)")
    assert lines[1:] == [
        "%2 float mul(a, a)",
        "%3 float b.z",
        "%4 float add(%2, %3)",
        "%5 float sqrt(%4)",
        "return %5",
    ]
    assert graph._repr_html_().startswith("<pre>&lt;lambda&gt;(")


class Half(go.BSDF):
    """Half a white surface, chosen from two plain numbers."""

    albedo: Any = go.spectrum(1.0, "share of light that is reflected", high=1.0)

    def eval(self, wo: Any, wi: Any, mode: str = "radiance") -> Any:
        """1 / (2 pi) above."""
        return self.albedo * ops.where(wi.z > 0.0, 0.5 / ops.pi, 0.0)


def test_a_choice_between_plain_numbers_is_as_exact_as_the_formula() -> None:
    up = np.array([[0.0, 0.0, 1.0]])
    types = ops.backend.types("float64")
    on_bound = Half().bind(types).eval(*[ops.backend.vector_of(up, 3, types)] * 2)
    for value in (Half().eval(up, up, precision="float64"), ops.backend.to_numpy(on_bound, 1)):
        assert value.dtype == np.float64
        assert np.all(np.abs(value - 0.5 / np.pi) <= 1e-16)
    assert Half().eval(up, up).dtype == np.float32
    assert go.Mix(a=Half(), b=Half()).eval(up, up, precision="float64")[0, 0] == 0.5 / np.pi


def test_what_the_caller_holds_is_not_looked_into() -> None:
    round_and_round: list[object] = []
    round_and_round.append(round_and_round)  # as a notebook's history may
    assert record(lambda a: ops.sqrt(a), a="float").evaluate(a=4.0) == 2.0


def test_values_in_tuples_and_dicts_are_named_by_their_place() -> None:
    def program(a):  # type: ignore[no-untyped-def]
        found = {"bend": a * 2.0, "pair": (a * 3.0, a * 4.0)}
        return found["bend"] + found["pair"][0] * found["pair"][1]

    names = {node.name for node in record(program, a="float").entry.nodes}
    assert {"found.bend", "found.pair.0", "found.pair.1"} <= names


def test_values_added_to_a_list_later_are_named() -> None:
    def program(a: Any) -> Any:
        lobes: list[Any] = []
        for scale in (2.0, 3.0):
            lobes.append(a * scale)
        return lobes[0] + lobes[1]

    names = {node.name for node in record(program, a="float").entry.nodes}
    assert {"lobes.0", "lobes.1"} <= names


def test_the_first_name_of_a_value_stays() -> None:
    def program(a: Any) -> Any:
        first = a * 2.0
        second = first
        third = first + 1.0
        return third + second

    names = {node.name for node in record(program, a="float").entry.nodes}
    assert "first" in names and "second" not in names


def test_a_vector_of_constants_multiplies_numbers_of_any_count() -> None:
    graph = record(lambda x: ops.vec3(1.0, 2.0, 3.0) * x, x="float")
    x = np.array([1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(graph.evaluate(x=x), np.outer([1.0, 2.0, 3.0], x))
