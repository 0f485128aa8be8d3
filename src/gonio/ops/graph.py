"""The recorder: running model code on symbols produces a typed graph with names, docstrings and source lines.

    graph = record(lambda a, b: sqrt(a * a + b * b), a="float", b="float")
    graph.evaluate(a=np.array([3.0]), b=np.array([4.0]))      # -> array([5.])

A graph is a list of functions in order of definition, the entry last. A function is a sequence of `Node`s without
branches (use `where`) or loops (Python loops unroll while recording). Calls of functions marked `@function` remain
calls, so that a shader writer can give each function its name, arguments and documentation.

Types are "float", "bool", "vec2", "vec3" and "spectrum". Operators broadcast a float over the components of the other
types. The number of channels of a spectrum is chosen when the graph is evaluated.
"""

from __future__ import annotations

import html
import inspect
import itertools
import math
import sys
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from pathlib import Path
from types import FrameType
from typing import Protocol, TypeAlias, TypeGuard

import numpy as np

from ..errors import GonioError
from ..owner import exclusive
from .table import fetch_in_numpy, read_in_numpy
from .types import Value

Operand: TypeAlias = "Node | float"

_HERE = str(Path(__file__).parent)
_SIZES = {"vec2": 2, "vec3": 3}
_COMPONENTS = {"x": 0, "y": 1, "z": 2}


class RecordingError(GonioError):
    """Code that cannot be recorded; names the file and line."""


class ForbiddenOperator(RecordingError):
    """A Python operator with no meaning on a value, or a different one: `if`, `and`, `**`."""


def _source_line() -> str:
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_HERE):
        frame = frame.f_back
    return f"{frame.f_code.co_filename}:{frame.f_lineno}"


def _name_locals(function: Function) -> None:
    """Give the values of `function` the names of the Python variables that currently hold them.

    Called for every new value, so that variables bound by earlier lines are still in scope. A name in the function's
    own frame has priority over one in a plain function that it calls, and the first name over a later one.
    """
    frames = []
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_code is not _define.__code__:
        if not frame.f_code.co_filename.startswith(_HERE):
            frames.append(frame)
        frame = frame.f_back
    for depth, own in enumerate(reversed(frames)):
        for name, value in own.f_locals.items():
            if isinstance(value, Node):
                if value.function is function and value.depth > depth:
                    value.name, value.depth = name.strip("_"), depth
            elif isinstance(value, _CONTAINERS):
                _name_parts(function, depth, value, (name,))


_CONTAINERS = (tuple, list, dict)
_PLAIN = (float, int, str, bool, type(None), np.ndarray)  # types that contain no values, checked first


def _name_parts(function: Function, depth: int, value: object, path: tuple) -> None:
    """`_name_locals` for the values inside a variable, in the order and with the paths of `_flatten`.

    It runs for every new value and usually finds nothing unnamed, so paths are built only when a value is named.
    """
    pairs: Iterable[tuple[object, object]]
    if isinstance(value, tuple | list):
        pairs = zip(getattr(value, "_fields", None) or range(len(value)), value, strict=True)
    elif isinstance(value, dict):
        pairs = value.items()
    elif _is_composite(value):
        pairs = value.__parts__().items()
    else:
        return
    for key, item in pairs:
        if isinstance(item, Node):
            if item.function is function and item.depth > depth:
                item.name, item.depth = ".".join(map(str, (*path, key))).strip("_"), depth
        elif not isinstance(item, _PLAIN):
            _name_parts(function, depth, item, (*path, key))


def _logical(op: str) -> Callable[[Node, object], Node]:
    """An operator with a Boolean result."""
    return lambda self, other: emit(op, "bool", self, other)


class Node:
    """One value in a recorded function: an operation, its arguments, its type and its source line.

    name  of the Python variable that held it, or ""; inside a tuple or dict with its key, "result.bend"
    """

    __slots__ = ("args", "depth", "function", "index", "name", "op", "source", "static", "type")
    __array_ufunc__ = None  # NumPy scalars on the left must defer to the operators below

    def __init__(self, function: Function, op: str, type: str, args: tuple, static: Value = None) -> None:
        self.function, self.op, self.type, self.args, self.static = function, op, type, args, static
        self.source = _source_line()
        self.name, self.depth = "", 1000
        self.index = len(function.nodes)
        # otherwise the variables of all calling frames would be searched
        if _stack and _stack[-1][1] is function:
            _name_locals(function)
        function.nodes.append(self)

    def __repr__(self) -> str:
        return f"%{self.index}:{self.type}={self.op}"

    def __bool__(self) -> bool:
        raise ForbiddenOperator(
            "a Python `if`, `and`, `or` or `not` on a value", _source_line(), "use where(mask, a, b), &, | and ~"
        )

    def __pow__(self, other: object) -> Node:
        hint = "use ops.pow(x, p), which is 0 where x <= 0, or ops.sqr(x)"
        raise ForbiddenOperator("`**` on a value, which is NaN where x < 0", _source_line(), hint)

    __rpow__ = __pow__

    def __getattr__(self, name: str) -> Node:
        if name in _COMPONENTS and _COMPONENTS[name] < _SIZES.get(self.type, 0):
            return emit("component", "float", self, static=_COMPONENTS[name])
        raise AttributeError(f"a {self.type} has no '{name}'")

    def __neg__(self) -> Node:
        return emit("neg", self.type, self)

    def __invert__(self) -> Node:
        return emit("not", "bool", self)

    def __add__(self, other: Operand) -> Node:
        return arithmetic("add", self, other)

    def __radd__(self, other: Operand) -> Node:
        return arithmetic("add", other, self)

    def __sub__(self, other: Operand) -> Node:
        return arithmetic("sub", self, other)

    def __rsub__(self, other: Operand) -> Node:
        return arithmetic("sub", other, self)

    def __mul__(self, other: Operand) -> Node:
        return arithmetic("mul", self, other)

    def __rmul__(self, other: Operand) -> Node:
        return arithmetic("mul", other, self)

    def __truediv__(self, other: Operand) -> Node:
        return arithmetic("div", self, other)

    def __rtruediv__(self, other: Operand) -> Node:
        return arithmetic("div", other, self)

    __lt__, __le__, __gt__, __ge__ = map(_logical, ("lt", "le", "gt", "ge"))
    __eq__, __ne__ = map(_logical, ("eq", "ne"))  # type: ignore[assignment]
    __and__, __or__ = map(_logical, ("and", "or"))
    __rand__, __ror__ = __and__, __or__
    __hash__ = object.__hash__


class Function:
    """A recorded function.

    name, doc, source  of the Python function it came from
    parameters         name -> type, in order; "self.alpha" is the field `alpha` of the model
    arguments          name -> the argument: nodes, objects and tuples of nodes
    nodes              every value, in order of evaluation
    result             the returned nodes in their structure (a tuple, a NamedTuple, a node)
    """

    def __init__(self, name: str, doc: str, source: str) -> None:
        self.name, self.doc, self.source = name, doc, source
        self.parameters: dict[str, str] = {}
        self.arguments: dict[str, Value] = {}
        self.nodes: list[Node] = []
        self.result: Value = None

    def parameter(self, name: str, type: str) -> Node:
        self.parameters[name] = type
        return Node(self, "parameter", type, (), static=name)

    def __str__(self) -> str:
        """One line per value: its number, its name in the source, its type and its expression."""
        lines = [f"{self.name}({', '.join(f'{name}: {type}' for name, type in self.parameters.items())})"]
        for node in self.nodes:
            if node.op != "parameter":
                lines.append(f"  %{node.index:<3} {node.name:<12} {node.type:<9} {_written(node)}".rstrip())
        return "\n".join([*lines, f"  return {', '.join(map(_reference, _leaves(self.result)))}"])


class Graph:
    """Recorded functions in order of definition; `entry` is the last.

    replacements  operation -> a vocabulary function to record instead, for languages without the operation
    single        whether it is recorded for 32 bits, see `ops.is_short`
    """

    def __init__(self, replacements: dict[str, Callable] | None = None, single: bool = False) -> None:
        self.functions: list[Function] = []
        self.replacements, self.single = replacements or {}, single
        self._known: dict[object, Function] = {}

    @property
    def entry(self) -> Function:
        return self.functions[-1]

    def __str__(self) -> str:
        return "\n\n".join(map(str, self.functions))

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"

    def evaluate(self, **values: Value) -> Value:
        """Run the graph on NumPy arrays in float64, as an independent evaluation of the same source.

        values  by parameter name ("self.alpha" of a model as self_alpha); vectors and spectra component first,
                shape (3, N), floats (N,) or numbers
        Returns what the recorded function returned, in the same structure.
        """
        given = {name: np.asarray(value) for name, value in values.items()}
        missing = [n for n in self.entry.parameters if n.replace(".", "_") not in given]
        if missing:
            raise RecordingError(f"no value for {', '.join(missing)}", self.entry.name)
        with np.errstate(all="ignore"):
            return _run(self.entry, [given[n.replace(".", "_")] for n in self.entry.parameters])


def _written(node: Node) -> str:
    """ "dot(%17, %19)"; static arguments follow the name, as in "element[1](%17)"."""
    arguments = ", ".join(map(_reference, node.args))
    if node.op == "constant":
        return str(node.static)
    if node.op == "component":
        return f"{arguments}.{'xyz'[node.static]}"
    if node.op == "call":
        return f"{node.static.name}({arguments})"
    return f"{node.op}({arguments})" if node.static is None else f"{node.op}[{node.static}]({arguments})"


def _reference(value: object) -> str:
    if not isinstance(value, Node):
        return f"{value:g}" if isinstance(value, float) else str(value)
    return str(value.static) if value.op == "parameter" else f"%{value.index}"


_stack: list[tuple[Graph, Function]] = []


def emit(op: str, type: str, *args: Value, static: Value = None) -> Node:
    """Append one operation to the function that is being recorded."""
    if not _stack:
        raise RecordingError("a recorded value is used after its recording ended", _source_line())
    graph, function = _stack[-1]
    for arg in args:
        if isinstance(arg, Node) and arg.function is not function:
            raise RecordingError(
                f"a value of '{arg.function.name}' is used inside '{function.name}'",
                _source_line(),
                "pass it as an argument: a @function has access to its arguments only",
            )
    if op in graph.replacements:
        return call(graph.replacements[op], args, {})
    return Node(function, op, type, args, static)


def type_of(value: object) -> str:
    if isinstance(value, Node):
        return value.type
    if isinstance(value, bool | np.bool_):
        return "bool"
    if isinstance(value, int | float | np.number):
        return "float"
    raise RecordingError(
        f"a {type(value).__name__} in recorded code", _source_line(), "use numbers and recorded values"
    )


def widest(*values: object) -> str:
    """The type of an elementwise operation: floats broadcast over one wider type."""
    types = {type_of(v) for v in values} - {"float"}
    if len(types) > 1:
        raise RecordingError(f"an operation mixes {' and '.join(sorted(types))}", _source_line())
    return types.pop() if types else "float"


def arithmetic(op: str, a: Operand, b: Operand) -> Node:
    return emit(op, widest(a, b), a, b)


# --------------------------------------------------------------------------- structured arguments and results


def _flatten(value: object, name: str) -> Iterator[tuple[str, Node]]:
    """The nodes inside an argument (node, tuple, list, dict, object with fields), each with its path."""
    if isinstance(value, Node):
        yield name, value
    elif isinstance(value, tuple | list):
        fields = getattr(value, "_fields", None) or [str(i) for i in range(len(value))]
        for field, item in zip(fields, value, strict=True):
            yield from _flatten(item, f"{name}.{field}")
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _flatten(item, f"{name}.{key}")
    elif _is_composite(value):
        for part, held in value.__parts__().items():
            yield from _flatten(held, f"{name}.{part}")


class Composite(Protocol):
    """An object whose parts a recording follows, such as a material."""

    def __parts__(self) -> Mapping[str, object]:
        """The parts that may contain values, by name."""

    def __with_parts__(self, parts: Mapping[str, object]) -> object:
        """A copy with these parts replaced."""


def _is_composite(value: object) -> TypeGuard[Composite]:
    # called for every local variable and every new value: isinstance with a Protocol took 80 % of the time of `emit`
    return hasattr(type(value), "__parts__")


def _rebuild(value: Value, replace: Callable[[Value], object], kind: type | tuple[type, ...] = Node) -> Value:
    """The same structure with each node, or each object of another kind, replaced."""
    if isinstance(value, kind):
        return replace(value)
    if isinstance(value, tuple | list):
        items = [_rebuild(item, replace, kind) for item in value]
        return type(value)(*items) if hasattr(value, "_fields") else type(value)(items)
    if isinstance(value, dict):
        return {key: _rebuild(item, replace, kind) for key, item in value.items()}
    if _is_composite(value):
        return value.__with_parts__({name: _rebuild(part, replace, kind) for name, part in value.__parts__().items()})
    return value


def _static_key(value: object) -> object:
    """The parts of an argument that are not nodes but determine the recording: names, flags, classes, plain numbers."""
    if isinstance(value, Node):
        return value.type
    if isinstance(value, tuple | list):
        return tuple(_static_key(item) for item in value)
    if isinstance(value, dict):
        return tuple((key, _static_key(item)) for key, item in value.items())
    if _is_composite(value):
        return (type(value), *((name, _static_key(part)) for name, part in value.__parts__().items()))
    try:
        hash(value)
    except TypeError:
        return id(value)
    # with the type, since True, 1 and 1.0 are equal keys; repr distinguishes 0.0 from -0.0
    return (type(value), repr(value) if isinstance(value, float) else value)


def _define(graph: Graph, python_function: Callable, arguments: dict[str, Value], name: str) -> Function:
    source = f"{python_function.__code__.co_filename}:{python_function.__code__.co_firstlineno}"
    function = Function(name, inspect.getdoc(python_function) or "", source)
    _stack.append((graph, function))
    try:
        given = [pair for argument, value in arguments.items() for pair in _flatten(value, argument)]
        parameters = iter([function.parameter(path, node.type) for path, node in given])
        inner = {argument: _rebuild(value, lambda _: next(parameters)) for argument, value in arguments.items()}
        function.arguments = dict(inner)
        # returned plain numbers become nodes, so that a result consists of nodes only
        function.result = _rebuild(python_function(**inner), _constant, (bool, int, float, np.number))
    finally:
        _stack.pop()
    graph.functions.append(function)
    return function


def _constant(number: float | np.number) -> Node:
    return emit("constant", type_of(number), static=number)


def class_name(value: object) -> str:
    """The name of a recorded object's class, without leading underscores, which shaders reject."""
    return type(value).__name__.lstrip("_")


def first_free(name: str, used: Container[str]) -> str:
    """The name itself or the first of name_2, name_3, ... that is unused."""
    names = itertools.chain([name], (f"{name}_{count}" for count in itertools.count(2)))
    return next(free for free in names if free not in used)


def call(python_function: Callable, args: tuple, kwargs: dict) -> Value:
    """Record a call of a `@function`; defines it first if this combination of argument types is new."""
    bound = inspect.signature(python_function).bind(*args, **kwargs)
    bound.apply_defaults()
    graph, _ = _stack[-1]
    for argument, value in bound.arguments.items():
        if type(value) is float:  # recorded as an argument; otherwise each number would define another function
            bound.arguments[argument] = emit("constant", "float", static=value)
    key = (python_function, *(_static_key(value) for value in bound.arguments.values()))
    function = graph._known.get(key)
    if function is None:
        used = {f.name for f in graph.functions} | {f.name for _, f in _stack}
        stem = python_function.__name__.strip("_")
        owner = bound.arguments.get("self")
        if owner is not None:
            stem = f"{class_name(owner)}_{stem}"
        elif python_function.__qualname__.count(".") == 1:  # a static method
            stem = f"{python_function.__qualname__.split('.')[0]}_{stem}"
        name = first_free(stem, used)
        function = graph._known[key] = _define(graph, python_function, dict(bound.arguments), name)
    nodes = [node for argument, value in bound.arguments.items() for _, node in _flatten(value, argument)]
    called = emit("call", "tuple", *nodes, static=function)
    if isinstance(function.result, Node):
        called.type = function.result.type
        return called
    counter = itertools.count()
    return _rebuild(function.result, lambda node: emit("element", node.type, called, static=next(counter)))


def recording(values: tuple) -> bool:
    """Whether any of the arguments holds a node."""
    return bool(_stack) and any(True for value in values for _ in _flatten(value, ""))


@exclusive
def record(
    python_function: Callable,
    *,
    types: dict[str, str] | None = None,
    name: str = "",
    into: Graph | None = None,
    **more: Value,
) -> Graph:
    """Record a function of named arguments.

    types  argument name -> "float", "bool", "vec2", "vec3" or "spectrum"; may also be given as keywords
    into   an empty graph to record into, for a graph with replacements
    more   arguments that are not symbols, passed on unchanged; objects may have symbolic fields
    """
    graph = Graph() if into is None else into
    kinds = dict(types or {})
    values = dict(more)
    for argument, value in list(values.items()):
        if value in ("float", "bool", "vec2", "vec3", "spectrum"):
            kinds[argument] = values.pop(argument)
    outer = Function("outer", "", "")
    signature = inspect.signature(python_function)
    arguments: dict[str, Value] = {}
    for argument in signature.parameters:
        if argument in kinds:
            arguments[argument] = Node(outer, "parameter", kinds[argument], (), static=argument)
        elif argument in values:
            arguments[argument] = values[argument]
    _define(graph, python_function, arguments, name or python_function.__name__.strip("_"))
    return graph


def symbol(kind: str) -> Node:
    """A free-standing symbol, for a field of an object that is passed to `record`."""
    return Node(Function("outer", "", ""), "parameter", kind, ())


# --------------------------------------------------------------------------- evaluation in NumPy


NUMPY: dict[str, Callable] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "lt": np.less,
    "le": np.less_equal,
    "gt": np.greater,
    "ge": np.greater_equal,
    "eq": np.equal,
    "ne": np.not_equal,
    "and": np.logical_and,
    "or": np.logical_or,
    "not": np.logical_not,
    "where": np.where,
    "sqrt": np.sqrt,
    "abs": np.abs,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "exp": np.exp,
    "log": np.log,
    "pow": np.power,
    "sin": np.sin,
    "cos": np.cos,
    "atan2": np.arctan2,
    "floor": np.floor,
    "erf": np.vectorize(math.erf, otypes=[float]),
    "copysign": np.copysign,
    "isfinite": np.isfinite,
    "dot": lambda a, b: sum(a[i] * b[i] for i in range(len(a))),
    "mean": lambda a: np.mean(a, axis=0),
    "max_component": lambda a: np.max(a, axis=0),
}


def _run(function: Function, arguments: list) -> Value:
    values: list[Value] = []
    remaining = iter(arguments)

    def get(arg: Value) -> Value:
        return values[arg.index] if isinstance(arg, Node) else arg

    for node in function.nodes:
        args = [get(a) for a in node.args]
        if node.op == "parameter":
            values.append(next(remaining))
        elif node.op == "constant":
            values.append(np.asarray(node.static))
        elif node.op == "component":
            values.append(args[0][node.static])
        elif node.op == "vector":
            values.append(np.stack(np.broadcast_arrays(*[np.asarray(a, float) for a in args])))
        elif node.op == "call":
            values.append(_run(node.static, args))
        elif node.op == "element":
            values.append(list(_leaves(args[0]))[node.static])
        elif node.op == "lookup":
            table, channel = node.static
            values.append(read_in_numpy(table, *args)[channel])
        elif node.op == "fetch":
            table, channel = node.static
            values.append(fetch_in_numpy(table, *args)[channel])
        else:
            values.append(NUMPY[node.op](*args))
    return _rebuild(function.result, get)


def _leaves(value: Value) -> Iterator[Value]:
    if isinstance(value, tuple | dict):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _leaves(item)
    else:
        yield value
