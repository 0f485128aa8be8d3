"""The parts of a Python file that are the same for every material and every array library."""

from __future__ import annotations

VECTOR = '''
class Vector:
    """A vector of two to four numbers or arrays, such as the directions of many pairs: v.x, v.xy."""

    __array_ufunc__ = None  # NumPy leaves the operators to this class
    __hash__ = None

    def __init__(self, *parts):
        self.parts = parts

    def __getattr__(self, letters):
        if letters.strip("xyzw") or not letters:
            raise AttributeError(letters)
        picked = [self.parts["xyzw".index(letter)] for letter in letters]
        return picked[0] if len(picked) == 1 else Vector(*picked)

    def __add__(self, other):
        return _ADD(self, other)

    def __radd__(self, other):
        return _ADD(other, self)

    def __sub__(self, other):
        return _SUB(self, other)

    def __rsub__(self, other):
        return _SUB(other, self)

    def __mul__(self, other):
        return _MUL(self, other)

    def __rmul__(self, other):
        return _MUL(other, self)

    def __truediv__(self, other):
        return _DIV(self, other)

    def __rtruediv__(self, other):
        return _DIV(other, self)

    def __neg__(self):
        return Vector(*(-x for x in self.parts))

    def __abs__(self):
        return Vector(*(abs(x) for x in self.parts))

    def __invert__(self):
        return Vector(*(~x for x in self.parts))

    def __lt__(self, other):
        return _LT(self, other)

    def __le__(self, other):
        return _LE(self, other)

    def __gt__(self, other):
        return _GT(self, other)

    def __ge__(self, other):
        return _GE(self, other)

    def __eq__(self, other):
        return _EQ(self, other)

    def __ne__(self, other):
        return _NE(self, other)


def _each(function):
    """Apply the function to each component of vectors."""
    def apply(*arguments):
        size = max((len(a.parts) for a in arguments if isinstance(a, Vector)), default=0)
        if not size:
            return function(*arguments)
        rows = [a.parts if isinstance(a, Vector) else (a,) * size for a in arguments]
        return Vector(*(function(*row) for row in zip(*rows)))
    return apply


_ADD, _SUB = _each(lambda a, b: a + b), _each(lambda a, b: a - b)
_MUL, _DIV = _each(lambda a, b: a * b), _each(lambda a, b: a / b)
_LT, _LE = _each(lambda a, b: a < b), _each(lambda a, b: a <= b)
_GT, _GE = _each(lambda a, b: a > b), _each(lambda a, b: a >= b)
_EQ, _NE = _each(lambda a, b: a == b), _each(lambda a, b: a != b)


def _vector(size):
    def make(*parts):
        flat = [x for part in parts for x in (part.parts if isinstance(part, Vector) else (part,))]
        return Vector(*(flat * size if len(flat) == 1 else flat))
    return make


vec2, vec3, vec4 = _vector(2), _vector(3), _vector(4)
'''

COMMON = '''
def dot(a, b):
    """Scalar product."""
    first, *others = (x * y for x, y in zip(a.parts, b.parts))
    return sum(others, first)


def mean(v):
    """Mean over the channels."""
    first, *others = v.parts
    return sum(others, first) * (1.0 / len(v.parts))


def max_component(v):
    """Largest channel."""
    first, *others = v.parts
    for part in others:
        first = maximum(first, part)
    return first


def _tables(shapes, *text):
    """Arrays (axis, ..., channels), one per group of up to four channels."""
    data = memoryview(zlib.decompress(base64.b85decode("".join(text)))).cast("d").tolist()
    tables = []
    for *axes, channels in shapes:
        count = math.prod(axes) * channels
        tables.append((axes, [_stored(data[i:count:channels]) for i in range(channels)]))
        data = data[count:]
    return tables


def _texels(table, at, like):
    """The channels at integer coordinates."""
    axes, channels = table
    index = 0
    for place, count in zip(at, axes):
        index = index * count + place
    picked = [_texel(channel, index, like) for channel in channels]
    return picked[0] if len(picked) == 1 else Vector(*picked)


def lookup(table, *at):
    """Values interpolated linearly between texel centers, at coordinates in [0, 1], which are clamped."""
    cells, places = [], []
    for x, count in zip(at, table[0]):
        position = minimum(maximum(x * float(count) - 0.5, 0.0), count - 1.0)
        cell = minimum(floor(position), float(max(count - 2, 0)))
        cells.append(_integers(cell))
        places.append(position - cell)
    total = 0.0
    for corner in itertools.product((0, 1), repeat=len(cells)):
        steps = [min(step, count - 1) for step, count in zip(corner, table[0])]
        weight = 1.0
        for step, place in zip(corner, places):
            weight = weight * (place if step else 1.0 - place)
        total = total + weight * _texels(table, [cell + step for cell, step in zip(cells, steps)], places[0])
    return total


def fetch(table, *at):
    """Values of the texel at integer coordinates, which are clamped."""
    return _texels(table, [_integers(minimum(maximum(x, 0.0), n - 1.0)) for x, n in zip(at, table[0])], at[0])
'''

ARGUMENTS = '''
def _arguments(parameters, *directions):
    """The struct of the material, and the directions as vectors."""
    unknown = [name for name in parameters if name not in DEFAULTS]
    if unknown:
        raise TypeError(f"unknown parameter {unknown[0]!r}; known: {', '.join(DEFAULTS)}")
    arrays = [_numbers(direction) for direction in directions]
    fields = [_field(parameters.get(name, value), kind, arrays[0]) for name, (value, kind) in DEFAULTS.items()]
    return _MATERIAL(*(fields or [0.0])), [Vector(*(a[..., i] for i in range(3))) for a in arrays]


def _field(value, kind, like):
    """A parameter: a color (..., 3), two alphas (..., 2), an angle in radians as (cos, sin), or a number."""
    value = _numbers(value, like)
    if kind == "angle":
        return Vector(cos(value), sin(value))
    size = {"spectrum": 3, "alpha": 2}.get(kind, 0)
    if not size:
        return value
    if value.ndim == 0:
        return Vector(*(value,) * size)
    if value.shape[-1] not in (1, size):
        raise TypeError(f"shape {tuple(value.shape)} given, a number or (..., {size}) expected")
    return Vector(*(value[..., i if value.shape[-1] == size else 0] for i in range(size)))


def _result(value, *like):
    """A result as arrays: one entry per pair, (..., 3) for a vector; a struct is converted field by field."""
    if isinstance(value, tuple):
        return type(value)(*(_result(part, *like) for part in value))
    parts = value.parts if isinstance(value, Vector) else (value,)
    spread = _broadcast(*parts, *(direction.x for direction in like))[: len(parts)]
    return _stack(spread) if isinstance(value, Vector) else spread[0]
'''
