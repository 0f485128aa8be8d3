"""WGSL's types, and the conversion of literals to the types of the other operands."""

from __future__ import annotations

from typing import NamedTuple


class Type(NamedTuple):
    """A type. Literals have abstract types, which become those of the other operands.

    kind    "float", "int", "uint", "bool", "abstract float", "abstract int", "vector", "matrix", "array", "struct",
            "pointer", "texture", "sampler" or "void"
    parts   the types of the components, columns or items, or of the target of a pointer
    length  number of components, columns or items; dimensions of a texture
    name    name of a struct
    """

    kind: str
    parts: tuple[Type, ...] = ()
    length: int = 0
    name: str = ""

    @property
    def scalar(self) -> Type:
        """The scalar type of a scalar, vector or matrix."""
        return self.parts[0].scalar if self.kind in ("vector", "matrix") else self

    @property
    def numbers(self) -> bool:
        """Whether the type is a scalar, vector or matrix."""
        return self.scalar.kind in _SCALARS

    def of(self, scalar: Type) -> Type:
        """The type with the same shape and another scalar type."""
        return self._replace(parts=(self.parts[0].of(scalar),)) if self.kind in ("vector", "matrix") else scalar

    def __str__(self) -> str:
        if self.kind == "vector":
            return f"vec{self.length}<{self.parts[0]}>"
        if self.kind == "matrix":
            return f"mat{self.length}x{self.parts[0].length}<{self.scalar}>"
        if self.kind == "array":
            return f"array<{self.parts[0]}, {self.length}>"
        if self.kind == "pointer":
            return f"ptr<{self.parts[0]}>"
        return self.name or {"float": "f32", "int": "i32", "uint": "u32"}.get(self.kind, self.kind)


_SCALARS = frozenset({"float", "int", "uint", "bool", "abstract float", "abstract int"})
FLOAT, INT, UINT, BOOL, VOID = Type("float"), Type("int"), Type("uint"), Type("bool"), Type("void")
ABSTRACT_FLOAT, ABSTRACT_INT, SAMPLER = Type("abstract float"), Type("abstract int"), Type("sampler")
SCALARS = {"f32": FLOAT, "i32": INT, "u32": UINT, "bool": BOOL}
REFUSED = {
    "f16": "the 16-bit type f16",
    "atomic": "an atomic type",
    "texture_depth_2d": "a depth texture",
    "texture_storage_2d": "a storage texture",
    "binding_array": "an array of bindings",
}


def vector(scalar: Type, length: int) -> Type:
    """vecN."""
    return Type("vector", (scalar,), length)


def matrix(scalar: Type, columns: int, rows: int) -> Type:
    """matCxR."""
    return Type("matrix", (vector(scalar, rows),), columns)


def _short() -> dict[str, Type]:
    letters = {"f": FLOAT, "i": INT, "u": UINT}
    names = {f"vec{n}{letter}": vector(one, n) for n in (2, 3, 4) for letter, one in letters.items()}
    return names | {f"mat{c}x{r}f": matrix(FLOAT, c, r) for c in (2, 3, 4) for r in (2, 3, 4)}


NAMED = SCALARS | _short() | {"sampler": SAMPLER}
TEXTURES = {"texture_1d": 1, "texture_2d": 2, "texture_3d": 3}
# names that require type arguments, which a constructor may infer from its values
VECTORS = {f"vec{n}": n for n in (2, 3, 4)}
MATRICES = {f"mat{c}x{r}": (c, r) for c in (2, 3, 4) for r in (2, 3, 4)}


def common(a: Type, b: Type) -> Type | None:
    """The common type of two scalar types; None if there is none."""
    if a == b:
        return a
    for one, other in ((a, b), (b, a)):
        if one == ABSTRACT_INT and other.kind in ("abstract float", "float", "int", "uint"):
            return other
        if one == ABSTRACT_FLOAT and other == FLOAT:
            return other
    return None


def concrete(type: Type) -> Type:
    """The type that an abstract type becomes if no other is required."""
    if type.kind == "array":
        return type._replace(parts=(concrete(type.parts[0]),))
    if not type.numbers:
        return type
    return type.of({ABSTRACT_FLOAT: FLOAT, ABSTRACT_INT: INT}.get(type.scalar, type.scalar))
