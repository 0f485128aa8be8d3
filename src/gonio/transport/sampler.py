"""Samplers: random numbers for positions on pixels and lamps, and for directions.

A sampler is a pure function of *(key, index, dimension)*: `key` identifies the pixel and the seed, `index` counts the
samples of this pixel, and `dimension` identifies the decision for which the numbers are used. Samplers have no state,
so a picture is bit-identical if it is divided into passes of any size, resumed, or distributed over several machines.

    >>> key = pixel_key(pixel, seed)
    >>> u = PAIRS["sobol"](key, index, dimension)    # two floats in [0, 1)

The indices of one (key, dimension) form a sequence. For Sobol points, every aligned block of 2^m indices is a
(0, m, 2)-net in base 2: each dyadic rectangle of area 2^-m contains exactly one point. Because blocks are nested, the
first n samples are well distributed for any n. Dimensions are padded (Burley2020): the indices are shuffled separately
for each dimension, so decisions are independent of each other, and each is stratified.

Nets are suited to integrands with discontinuities, such as those over a pixel or a lamp. Functions of direction are
periodic and mostly smooth. For smooth functions and 16 to 64 points, a randomly shifted lattice reduces the error by a
factor of 3 to 100 (Sloan1994), at half the cost. The sampler `default` uses each where it is better.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import drjit as dr

from ..bridge.types import Float, UInt

Pair: TypeAlias = tuple[Float, Float]
PairFunction: TypeAlias = Callable[[UInt, UInt, UInt], Pair]  # a function of (key, index, dimension)

SAMPLERS: dict[str, str] = {
    "sobol": "Owen-scrambled Sobol pairs, shuffled per pixel and dimension; any number of samples",
    "lattice": "randomly shifted lattices, shuffled per pixel and dimension; any number of samples",
    "independent": "independent pseudo-random numbers: highest noise, for comparison",
}


def mix(a: UInt, b: UInt) -> UInt:
    """Hash two 32-bit words into one (the `lowbias32` finalizer of C. Wellons, whose bias is 0.17 by his measure).

    Multiplying `b` by the golden ratio first spreads small integers over all bits.
    """
    h = a ^ (b * 0x9E3779B9)
    h = (h ^ (h >> 16)) * 0x7FEB352D
    h = (h ^ (h >> 15)) * 0x846CA68B
    return h ^ (h >> 16)


def pixel_key(pixel: UInt, seed: UInt) -> UInt:
    """The 32-bit key of a pixel and a seed; keys of different pixels and seeds are uncorrelated."""
    return mix(mix(pixel, seed), seed ^ 0xA511E9B3)


def owen_hash(x: UInt, seed: UInt) -> UInt:
    """Owen scrambling of a *bit-reversed* word: bit i is flipped by a hash of the lower bits and the seed.

    This is the Laine-Karras construction. In additions and multiplications by odd numbers, carries propagate only
    upward. In reversed words, each digit therefore depends only on more significant digits, as nested uniform
    scrambling requires. The constants are N. Vegdahl's, as in pbrt-v4's FastOwenScrambler.
    """
    x = x ^ (x * 0x3D20ADEA)  # never `^=`, which would modify the caller's Dr.Jit array
    x = (x + seed) * ((seed >> 16) | 1)
    x = x ^ (x * 0x05526C56)
    return x ^ (x * 0x53A22864)


def pascal(x: UInt) -> UInt:
    """The second Sobol dimension before bit reversal: the Pascal matrix times x, modulo 2.

    This matrix is the fifth Kronecker power of [[1, 1], [0, 1]], so five masked shifts multiply it with 32 bits
    (Ahmed2024). The usual direction numbers would require up to 32 steps.
    """
    x = x ^ ((x & 0xAAAAAAAA) >> 1)
    x = x ^ ((x & 0xCCCCCCCC) >> 2)
    x = x ^ ((x & 0xF0F0F0F0) >> 4)
    x = x ^ ((x & 0xFF00FF00) >> 8)
    return x ^ (x >> 16)


def unit(x: UInt) -> Float:
    """Convert a 32-bit word to a float in [0, 1).

    Only the upper 24 bits are used, which float32 represents exactly, so the result is always less than 1.
    """
    return dr.float32_array_t(x)(x >> 8) * 2.0**-24


def sobol_pair(key: UInt, index: UInt, dimension: UInt) -> Pair:
    """Point `index` of an Owen-scrambled Sobol sequence, shuffled for this key and dimension (Burley2020, sec. 3)."""
    seed = mix(key, type(key)(dimension))
    shuffled = dr.brev(owen_hash(dr.brev(type(key)(index)), seed))
    x = owen_hash(shuffled, mix(seed, type(key)(0x51633E2D)))
    y = owen_hash(pascal(shuffled), mix(seed, type(key)(0x68BC21EB)))
    return unit(dr.brev(x)), unit(dr.brev(y))


def independent_pair(key: UInt, index: UInt, dimension: UInt) -> Pair:
    """Two independent numbers, which are hashes of a counter and as good as those of a stateful generator."""
    word = mix(mix(key, type(key)(dimension)), type(key)(index))
    return unit(mix(word, type(key)(0x51633E2D))), unit(mix(word, type(key)(0x68BC21EB)))


# The slope y / x of the lattice: the first 32-bit word for which the shortest dual vector of the lattices of 2, 4, ...
# 2^20 points is at least 0.66 times as long as that of a hexagonal lattice. It was found by a search bit by bit that
# kept the 400 best candidates. The ratio is 0.74 for 16 points and 0.89 for 64.
SLOPE = 1030637


def lattice_pair(key: UInt, index: UInt, dimension: UInt) -> Pair:
    """Point `index` of a rank-1 lattice sequence in base 2 (Hickernell2000), randomly shifted and shuffled.

    Every aligned block of 2^m indices is a translated lattice of 2^m points.
    """
    seed = mix(key, type(key)(dimension))
    x = owen_hash(dr.brev(type(key)(index)), seed)
    return unit(x + mix(seed, type(key)(0x51633E2D))), unit(x * SLOPE + mix(seed, type(key)(0x68BC21EB)))


#: The pair function of each sampler: (key, index, dimension) -> (x, y) in [0, 1)^2.
PAIRS: dict[str, PairFunction] = {
    "sobol": sobol_pair,
    "lattice": lattice_pair,
    "independent": independent_pair,
}

#: The samplers that `sampler="default"` uses for positions on pixels and lamps, and for directions.
DEFAULT = ("sobol", "lattice")
