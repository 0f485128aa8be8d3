"""The syntax tree of a WGSL text: expressions, statements and declarations, each with its line."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class Node:
    """A node of the syntax tree."""

    line: int


@dataclass(slots=True)
class Expression(Node):
    """An expression, or a type."""


@dataclass(slots=True)
class Literal(Expression):
    """A number or `true`, as written."""

    text: str


@dataclass(slots=True)
class Name(Expression):
    """A name, possibly `a::b`, with type arguments in `<>`."""

    text: str
    arguments: list[Expression] = field(default_factory=list)


@dataclass(slots=True)
class Call(Expression):
    """A call of a function or of a type's constructor."""

    function: Name
    arguments: list[Expression]


@dataclass(slots=True)
class Index(Expression):
    """base[index]."""

    base: Expression
    index: Expression


@dataclass(slots=True)
class Member(Expression):
    """base.name, a member or a swizzle."""

    base: Expression
    name: str


@dataclass(slots=True)
class Unary(Expression):
    """-x, !x, ~x, &x or *x."""

    sign: str
    inside: Expression


@dataclass(slots=True)
class Chain(Expression):
    """A left-associative chain of binary operations, (first sign right) sign right ..., so that long sums are not
    nested."""

    first: Expression
    rest: list[tuple[str, Expression, int]]  # sign, right operand, line


@dataclass(slots=True)
class Statement(Node):
    """A statement."""


@dataclass(slots=True)
class Block(Statement):
    """A block, { ... }."""

    statements: list[Statement]


@dataclass(slots=True)
class Declared(Statement):
    """let, var, const or override, inside or outside a function.

    space  "uniform", "private", ..., for module-scope variables
    """

    kind: str
    name: str
    type: Expression | None
    value: Expression | None
    space: str = ""


@dataclass(slots=True)
class Assign(Statement):
    """target sign value; the target is None for `_ = value`."""

    target: Expression | None
    sign: str
    value: Expression


@dataclass(slots=True)
class Evaluate(Statement):
    """A call whose result is ignored."""

    value: Expression


@dataclass(slots=True)
class If(Statement):
    """if, else if, else: (condition, block) in order; the last condition is None for `else`."""

    clauses: list[tuple[Expression | None, Block]]


@dataclass(slots=True)
class Loop(Statement):
    """Any loop: initial statement, condition, body, continuing statements, and the condition at their end that ends
    it."""

    start: Statement | None
    condition: Expression | None
    body: Block
    after: list[Statement]
    until: Expression | None


@dataclass(slots=True)
class Switch(Statement):
    """switch: (selectors, block); the selector None means `default`."""

    selector: Expression
    cases: list[tuple[list[Expression | None], Block]]


@dataclass(slots=True)
class Return(Statement):
    """return value."""

    value: Expression | None


@dataclass(slots=True)
class Jump(Statement):
    """break, continue or discard."""

    kind: str


@dataclass(slots=True)
class Parameter(Node):
    """A parameter of a function, or a member of a struct."""

    name: str
    type: Expression


@dataclass(slots=True)
class Function(Node):
    """A function; `entry` is true for the entry point of a stage."""

    name: str
    parameters: list[Parameter]
    result: Expression | None
    body: Block
    entry: bool


@dataclass(slots=True)
class Struct(Node):
    """A struct."""

    name: str
    members: list[Parameter]


@dataclass(slots=True)
class Alias(Node):
    """Another name for a type."""

    name: str
    type: Expression


@dataclass(slots=True)
class Assertion(Node):
    """const_assert."""

    condition: Expression


Declaration = Function | Struct | Alias | Declared


def names_in(expression: Expression) -> set[str]:
    """The names of values that an expression uses."""
    names, waiting = set(), [expression]
    while waiting:
        one = waiting.pop()
        if isinstance(one, Name):
            names.add(one.text)
        elif isinstance(one, Call):
            waiting += one.arguments
        elif isinstance(one, Index):
            waiting += [one.base, one.index]
        elif isinstance(one, Member):
            waiting.append(one.base)
        elif isinstance(one, Unary):
            waiting.append(one.inside)
        elif isinstance(one, Chain):
            waiting += [one.first, *(right for _, right, _ in one.rest)]
    return names
