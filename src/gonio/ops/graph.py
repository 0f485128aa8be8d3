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

import contextlib
import html
import inspect
import itertools
import sys
from collections.abc import Callable, Container, Iterator, Sequence
from typing import TypeAlias

import numpy as np

from ..errors import GonioError
from ..owner import exclusive
from .evaluation import NUMPY as NUMPY
from .evaluation import operate
from .naming import HERE, LocalNames
from .structure import flatten, leaves, rebuild, static_key
from .types import Value

Operand: TypeAlias = "Node | float"

_SIZES = {"vec2": 2, "vec3": 3}
_COMPONENTS = {"x": 0, "y": 1, "z": 2}


class RecordingError(GonioError):
    """Code cannot be recorded; the error names the file and line."""


class ForbiddenOperator(RecordingError):
    """Code applies a Python operator, such as `if`, `and` or `**`, to a value for which it has no meaning or a
    different one."""


foreign = ""  # "file:line" of the text that is being read, if the values do not come from Python code


def _source_line() -> str:
    if foreign:
        return foreign
    frame = sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(HERE):
        frame = frame.f_back
    return f"{frame.f_code.co_filename}:{frame.f_lineno}"


def _logical(op: str) -> Callable[[Node, object], Node]:
    """An operator with a Boolean result."""
    return lambda self, other: emit(op, "bool", self, other)


class Node:
    """One value in a recorded function: an operation, its arguments, its type and its source line.

    name  name of the Python variable that held it, or ""; for an item of a tuple or dict with its key, "result.bend"
    """

    __slots__ = ("args", "depth", "function", "index", "name", "op", "source", "static", "type")
    __array_ufunc__ = None  # NumPy scalars on the left must defer to the operators below

    def __init__(self, function: Function, op: str, type: str, args: tuple, static: Value = None) -> None:
        self.function, self.op, self.type, self.args, self.static = function, op, type, args, static
        self.source = _source_line()
        self.name, self.depth = "", 1000
        self.index = len(function.nodes)
        # otherwise the variables of all calling frames would have to be searched
        if function.names is not None and _stack[-1][1] is function:
            function.names.search()
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

    name, doc, source  name, docstring and source line of the Python function
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
        self.names: LocalNames | None = None  # while it is being recorded

    def parameter(self, name: str, type: str) -> Node:
        self.parameters[name] = type
        return Node(self, "parameter", type, (), static=name)

    def __str__(self) -> str:
        """One line per value: its number, its name in the source, its type and its expression."""
        lines = [f"{self.name}({', '.join(f'{name}: {type}' for name, type in self.parameters.items())})"]
        for node in self.nodes:
            if node.op != "parameter":
                lines.append(f"  %{node.index:<3} {node.name:<12} {node.type:<9} {_written(node)}".rstrip())
        return "\n".join([*lines, f"  return {', '.join(map(_reference, leaves(self.result)))}"])


class Graph:
    """Recorded functions in order of definition; `entry` is the last.

    replacements  operation -> a vocabulary function to record instead, for languages without the operation
    single        whether it is recorded for float32; see `ops.is_short`
    named         whether values are named after the variables that hold them, which takes nine tenths of the time
    """

    def __init__(
        self, replacements: dict[str, Callable] | None = None, single: bool = False, named: bool = True
    ) -> None:
        self.functions: list[Function] = []
        self.replacements, self.single, self.named = replacements or {}, single, named
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
            results = iter(results_of(self.entry, [given[n.replace(".", "_")] for n in self.entry.parameters]))
        return rebuild(self.entry.result, lambda _: next(results), Node)


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
    """The type of the result of an elementwise operation: floats broadcast to the wider type."""
    types = {type_of(v) for v in values} - {"float"}
    if len(types) > 1:
        raise RecordingError(f"an operation mixes {' and '.join(sorted(types))}", _source_line())
    return types.pop() if types else "float"


def arithmetic(op: str, a: Operand, b: Operand) -> Node:
    return emit(op, widest(a, b), a, b)


# --------------------------------------------------------------------------- structured arguments and results


def _flatten(value: object, name: str) -> Iterator[tuple[str, Node]]:
    """The nodes inside an argument, each with its path."""
    return flatten(value, name, Node)


def _define(graph: Graph, python_function: Callable, arguments: dict[str, Value], name: str) -> Function:
    source = f"{python_function.__code__.co_filename}:{python_function.__code__.co_firstlineno}"
    function = Function(name, inspect.getdoc(python_function) or "", source)
    _stack.append((graph, function))
    function.names = LocalNames(function, Node, _define.__code__) if graph.named else None
    try:
        given = [pair for argument, value in arguments.items() for pair in _flatten(value, argument)]
        parameters = iter([function.parameter(path, node.type) for path, node in given])
        inner = {argument: rebuild(value, lambda _: next(parameters), Node) for argument, value in arguments.items()}
        function.arguments = dict(inner)
        # returned plain numbers become nodes, so that a result consists of nodes only
        function.result = rebuild(python_function(**inner), _constant, (bool, int, float, np.number))
    finally:
        _stack.pop()
        function.names = None
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


def call(python_function: Callable, args: tuple, kwargs: dict, *, constants: bool = False) -> Value:
    """Record a call of a `@function`, which is defined first if this combination of argument types is new.

    constants  whether results that are plain numbers remain plain numbers
    """
    bound = inspect.signature(python_function).bind(*args, **kwargs)
    bound.apply_defaults()
    graph, _ = _stack[-1]
    for argument, value in bound.arguments.items():
        if type(value) is float:  # recorded as an argument; otherwise each number would define a new function
            bound.arguments[argument] = emit("constant", "float", static=value)
    key = (python_function, *(static_key(value, Node) for value in bound.arguments.values()))
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
    if constants and all(node.op == "constant" for _, node in _flatten(function.result, "")):
        return rebuild(function.result, lambda node: node.static, Node)
    nodes = [node for argument, value in bound.arguments.items() for _, node in _flatten(value, argument)]
    called = emit("call", "tuple", *nodes, static=function)
    if isinstance(function.result, Node):
        called.type = function.result.type
        return called
    counter = itertools.count()

    def element(node: Node) -> Value:
        place = next(counter)
        if constants and node.op == "constant":
            return node.static
        return emit("element", node.type, called, static=place)

    return rebuild(function.result, element, Node)


@contextlib.contextmanager
def unnamed() -> Iterator[None]:
    """A context in which the current function records values without names.

    The variables of an interpreter do not describe the program that it runs, and searching them takes nine tenths of
    the time. Values of functions that are defined inside the context are named as usual.
    """
    function = _stack[-1][1] if _stack else Function("outer", "", "")
    names, function.names = function.names, None
    try:
        yield
    finally:
        function.names = names


def recording(values: tuple) -> bool:
    """Whether any of the arguments contains a node."""
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
    name   name of the function in the graph; by default, its own name
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
    """A free-standing symbol of the type `kind`, for a field of an object that is passed to `record`."""
    return Node(Function("outer", "", ""), "parameter", kind, ())


# --------------------------------------------------------------------------- evaluation in NumPy


def results_of(function: Function, arguments: Sequence[Value]) -> list[Value]:
    """The results of a function in NumPy, one for each value in the structure that it returns."""
    results = [node for _, node in _flatten(function.result, "")]
    last = {arg: node for node in function.nodes for arg in node.args if isinstance(arg, Node)}
    for node in results:
        last.pop(node, None)
    values: dict[Node, Value] = {}
    remaining = iter(arguments)
    for node in function.nodes:
        args = [values[arg] if isinstance(arg, Node) else arg for arg in node.args]
        for arg in node.args:  # arrays that are no longer needed are freed
            if isinstance(arg, Node) and last.get(arg) is node:
                values.pop(arg, None)
        if node.op == "parameter":
            values[node] = next(remaining)
        elif node.op == "constant":
            values[node] = np.asarray(node.static)
        elif node.op == "call":
            inner = results_of(node.static, args)
            values[node] = inner[0] if isinstance(node.static.result, Node) else inner
        elif node.op == "element":
            values[node] = args[0][node.static]
        else:
            values[node] = operate(node.op, node.static, args)
    return [values[node] for node in results]
