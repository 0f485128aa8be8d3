"""A recursive-descent parser of WGSL: tokens to declarations. Depth is bounded; time depends on the tokens alone."""

from __future__ import annotations

from collections.abc import Callable

from ..values import refuse
from .syntax import (
    Alias,
    Assertion,
    Assign,
    Block,
    Call,
    Chain,
    Declaration,
    Declared,
    Evaluate,
    Expression,
    Function,
    If,
    Index,
    Jump,
    Literal,
    Loop,
    Member,
    Name,
    Parameter,
    Return,
    Statement,
    Struct,
    Switch,
    Unary,
)
from .tokens import MAX_NESTING, Words

# binary operators, lowest precedence first; that comparisons cannot be chained is not checked
_LEVELS = (("||",), ("&&",), ("|",), ("^",), ("&",), ("==", "!="), ("<", ">", "<=", ">="), ("<<", ">>"), ("+", "-"),
           ("*", "/", "%"))  # fmt: skip
_STRENGTH = {sign: level for level, signs in enumerate(_LEVELS) for sign in signs}
_ASSIGN = frozenset({"=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="})


def parsed(text: str, where: str) -> tuple[dict[str, Declaration], list[Assertion]]:
    """The declarations of a text by name, and its assertions. Raises InputError, with file and line."""
    return _Parser(text, where).module()


class _Parser(Words):
    """Declarations, expressions and statements, one method each."""

    # ------------------------------------------------------------------ declarations

    def module(self) -> tuple[dict[str, Declaration], list[Assertion]]:
        items: dict[str, Declaration] = {}
        assertions: list[Assertion] = []
        while self.word.kind != "end":
            one = self.declaration()
            if isinstance(one, Assertion):
                assertions.append(one)
            elif one is not None:
                if one.name in items:
                    raise refuse(f"'{one.name}' is declared twice", "rename one", f"{self.where}:{one.line}")
                items[one.name] = one
        return items, assertions

    def declaration(self) -> Declaration | Assertion | None:
        attributes = self.attributes()
        word = self.take()
        line = word.line
        if word.text == ";":
            return None
        if word.text in ("enable", "requires", "diagnostic"):
            while self.word.text != ";" and self.word.kind != "end":
                self.take()
            self.expect(";")
            return None
        if word.text == "fn":
            return self.function(line, bool(attributes & {"vertex", "fragment", "compute"}))
        if word.text == "struct":
            return Struct(line, self.name(), self.members())
        if word.text in ("alias", "type"):
            name = self.name()
            self.expect("=")
            alias = Alias(line, name, self.type())
            self.expect(";")
            return alias
        if word.text in ("const", "override", "var", "let"):
            declared = self.declared("const" if word.text == "let" else word.text, line)
            self.expect(";")
            return declared
        if word.text in ("const_assert", "static_assert"):
            assertion = Assertion(line, self.expression())
            self.expect(";")
            return assertion
        self.at -= 1 if word.kind != "end" else 0
        raise self.error("a declaration (fn, struct, var, const, override or alias)")

    def attributes(self) -> set[str]:
        items = set()
        while self.accept("@"):
            items.add(self.name())
            if self.word.text == "(":
                self.arguments()
        return items

    def function(self, line: int, entry: bool) -> Function:
        name = self.name()
        self.expect("(")
        parameters = self.listed(")")
        result = None
        if self.accept("->"):
            self.attributes()
            result = self.type()
        return Function(line, name, parameters, result, self.block(), entry)

    def members(self) -> list[Parameter]:
        self.expect("{")
        members = self.listed("}")
        self.accept(";")
        return members

    def listed(self, end: str) -> list[Parameter]:
        items = []
        while not self.accept(end):
            self.attributes()
            line, name = self.word.line, self.name()
            self.expect(":")
            items.append(Parameter(line, name, self.type()))
            if not self.accept(",") and not self.accept(";") and self.word.text != end:
                raise self.error(f"',' or '{end}'")
        return items

    def declared(self, kind: str, line: int) -> Declared:
        space = ""
        if kind == "var" and self.word.text == "<":  # not after a name, so `<` does not open a list of type arguments
            self.take()
            space = self.name()
            while not self.accept(">"):
                self.take()
                if self.word.kind == "end":
                    raise self.error("'>'")
        elif kind == "var" and self.word.kind == "open":
            self.take()
            space = self.name()
            while self.take().kind != "close":
                if self.word.kind == "end":
                    raise self.error("'>'")
        name = self.name()
        type = self.type() if self.accept(":") else None
        value = self.expression() if self.accept("=") else None
        return Declared(line, kind, name, type, value, space)

    def type(self) -> Expression:
        """A type: a name with arguments."""
        line, name = self.word.line, self.name()
        return Name(line, name, self.list_of_type())

    def list_of_type(self) -> list[Expression]:
        items: list[Expression] = []
        if self.word.kind == "open":
            self.deeper()
            self.take()
            while self.word.kind != "close":
                items.append(self.expression())
                if not self.accept(",") and self.word.kind != "close":
                    raise self.error("',' or '>'")
            self.take()
            self.depth -= 1
        return items

    # ------------------------------------------------------------------ expressions

    def expression(self, level: int = 0) -> Expression:
        """An expression whose binary operators have at least the precedence `level`."""
        left = self.unary()
        while (strength := _STRENGTH.get(self.sign(), -1)) >= level:
            rest = []
            line = self.word.line
            while _STRENGTH.get(sign := self.sign(), -1) == strength:
                place = self.word.line
                self.at += 2 if sign in (">>", ">=") else 1
                rest.append((sign, self.expression(strength + 1), place))
            left = Chain(line, left, rest)
        return left

    def sign(self) -> str:
        """The next operator; `>>` and `>=` consist of separate tokens."""
        word = self.word
        if word.kind != "sign":
            return ""
        if word.text == ">" and word.joined:
            following = self.words[self.at + 1]
            if following.text in (">", "=") and following.kind == "sign":
                third = self.words[self.at + 2].text if following.text == ">" and following.joined else ""
                return "" if third == "=" else f">{following.text}"
        return word.text

    def unary(self) -> Expression:
        signs = []
        while self.word.kind == "sign" and self.word.text in ("-", "!", "~", "&", "*", "--", "&&"):
            word = self.take()
            signs += [(sign, word.line) for sign in word.text]
            if len(signs) > MAX_NESTING:
                raise self.error("a value")
        value = self.postfix(self.primary())
        for sign, line in reversed(signs):
            value = Unary(line, sign, value)
        return value

    def postfix(self, value: Expression) -> Expression:
        for _ in range(MAX_NESTING):
            line = self.word.line
            if self.accept("."):
                value = Member(line, value, self.name())
            elif self.accept("["):
                self.deeper()
                value = Index(line, value, self.expression())
                self.depth -= 1
                self.expect("]")
            else:
                return value
        raise self.error("an end of members and indices")

    def primary(self) -> Expression:
        word = self.word
        if word.text == "(":
            self.deeper()
            self.take()
            value = self.expression()
            self.expect(")")
            self.depth -= 1
            return value
        if word.kind == "number" or word.text in ("true", "false"):
            self.take()
            return Literal(word.line, word.text)
        if word.kind != "name":
            raise self.error("a value")
        self.take()
        name = Name(word.line, word.text, self.list_of_type())
        return Call(word.line, name, self.arguments()) if self.word.text == "(" else name

    def arguments(self) -> list[Expression]:
        self.deeper()
        self.expect("(")
        items = []
        while not self.accept(")"):
            items.append(self.expression())
            if not self.accept(",") and self.word.text != ")":
                raise self.error("',' or ')'")
        self.depth -= 1
        return items

    # ------------------------------------------------------------------ statements

    def block(self) -> Block:
        self.attributes()
        self.deeper()
        line = self.expect("{").line
        items: list[Statement] = []
        while not self.accept("}"):
            if self.word.kind == "end":
                raise self.error("'}'")
            if (one := self.statement()) is not None:
                items.append(one)
        self.depth -= 1
        return Block(line, items)

    def statement(self) -> Statement | None:
        self.attributes()
        word = self.word
        if word.text == "{":
            return self.block()
        if self.accept(";"):
            return None
        keyword: Callable[[int], Statement] | None = {
            "if": self.branch, "for": self.counted, "while": self.repeated, "loop": self.loop, "switch": self.switch,
        }.get(word.text)  # fmt: skip
        if keyword is not None and word.kind == "name":
            self.take()
            return keyword(word.line)
        one = self.simple()
        self.expect(";")
        return one

    def simple(self) -> Statement:
        """A statement without a block: a declaration, jump, assignment or call."""
        line, text = self.word.line, self.word.text
        if self.word.kind == "name":
            if text in ("let", "var", "const"):
                self.take()
                return self.declared(text, line)
            if text in ("break", "continue", "discard"):
                self.take()
                return Jump(line, text)
            if text == "return":
                self.take()
                return Return(line, None if self.word.text == ";" else self.expression())
            if text in ("const_assert", "static_assert"):
                self.take()
                return Evaluate(line, self.expression())
            if text == "_":
                self.take()
                self.expect("=")
                return Assign(line, None, "=", self.expression())
        target = self.unary()
        sign = self.word.text
        if sign in ("++", "--"):
            self.take()
            return Assign(line, target, f"{sign[0]}=", Literal(line, "1"))
        if sign == ">" and self.word.joined:  # >>=
            self.take()
            self.expect(">")
            self.expect("=")
            return Assign(line, target, ">>=", self.expression())
        if sign in _ASSIGN:
            self.take()
            return Assign(line, target, sign, self.expression())
        if not isinstance(target, Call):
            raise self.error("an assignment or a call")
        return Evaluate(line, target)

    def branch(self, line: int) -> If:
        clauses: list[tuple[Expression | None, Block]] = [(self.expression(), self.block())]
        while self.accept("else"):
            if not self.accept("if"):
                clauses.append((None, self.block()))
                break
            clauses.append((self.expression(), self.block()))
        return If(line, clauses)

    def counted(self, line: int) -> Loop:
        self.expect("(")
        start = None if self.word.text == ";" else self.simple()
        self.expect(";")
        condition = None if self.word.text == ";" else self.expression()
        self.expect(";")
        after = [] if self.word.text == ")" else [self.simple()]
        self.expect(")")
        return Loop(line, start, condition, self.block(), after, None)

    def repeated(self, line: int) -> Loop:
        return Loop(line, None, self.expression(), self.block(), [], None)

    def loop(self, line: int) -> Loop:
        self.attributes()
        self.deeper()
        body, after, until = Block(self.expect("{").line, []), list[Statement](), None
        while not self.accept("}"):
            if self.word.text == "continuing":
                self.take()
                after, until = self.continuing()
                self.expect("}")
                break
            if (one := self.statement()) is not None:
                body.statements.append(one)
        self.depth -= 1
        return Loop(line, None, None, body, after, until)

    def continuing(self) -> tuple[list[Statement], Expression | None]:
        self.expect("{")
        items: list[Statement] = []
        while not self.accept("}"):
            if self.word.text == "break" and self.words[self.at + 1].text == "if":
                self.at += 2
                until = self.expression()
                self.expect(";")
                self.expect("}")
                return items, until
            if (one := self.statement()) is not None:
                items.append(one)
        return items, None

    def switch(self, line: int) -> Switch:
        selector = self.expression()
        self.attributes()
        self.expect("{")
        cases: list[tuple[list[Expression | None], Block]] = []
        while not self.accept("}"):
            selectors: list[Expression | None] = []
            if self.accept("default"):
                selectors.append(None)
            else:
                self.expect("case")
                while self.word.text not in (":", "{"):
                    selectors.append(None if self.accept("default") else self.expression())
                    if not self.accept(","):
                        break
            self.accept(":")
            cases.append((selectors, self.block()))
        return Switch(line, selector, cases)
