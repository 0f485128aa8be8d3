"""Sample points: positions on the pixel and on the light, and directions of lobes.

A sampler here is a pure function of *(key, index, dimension)*: `key` identifies the pixel and the seed, `index` counts
the samples of that pixel, `dimension` identifies the decision that uses the numbers. There is no state, so a picture
can be divided into passes of any size, resumed, or distributed over machines, and is bit-identical.

    >>> key = pixel_key(pixel, seed)
    >>> u = PAIRS["sobol"](key, index, dimension)    # two floats in [0, 1)

The indices of one (key, dimension) form a sequence: for Sobol points every aligned block of 2^m indices is a
(0, m, 2)-net in base 2 -- each dyadic rectangle of area 2^-m holds exactly one point -- and because blocks nest, any
*first n* samples are as even as n allows. Different dimensions are padded (Burley2020): each has its own shuffle of
the indices, so that decisions are independent of each other while each is stratified.

Nets suit integrands with edges: a pixel, a lamp. Functions of direction are periodic, and mostly smooth: there a
randomly shifted lattice has a much smaller error (Sloan1994), by a factor of 3 to 100 for smooth functions at 16 to 64
points, at half the cost. `default` uses each where it is better.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import drjit as dr

from ..bridge.types import Float, UInt

Pair: TypeAlias = tuple[Float, Float]
PairFunction: TypeAlias = Callable[[UInt, UInt, UInt], Pair]  # of (key, index, dimension)

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
    """The key of a pixel and a seed: 32 bits, decorrelated between pixels and between seeds."""
    return mix(mix(pixel, seed), seed ^ 0xA511E9B3)


def owen_hash(x: UInt, seed: UInt) -> UInt:
    """Owen scrambling of a *bit-reversed* word: bit i is flipped by a hash of the bits below it and the seed.

    The Laine-Karras construction: additions and multiplications by odd numbers carry only upwards, so that on
    reversed words each digit depends on more significant digits alone, as nested uniform scrambling requires. The
    constants are N. Vegdahl's, as in pbrt-v4's FastOwenScrambler.
    """
    x = x ^ (x * 0x3D20ADEA)  # never `^=`, which would modify the caller's Dr.Jit array
    x = (x + seed) * ((seed >> 16) | 1)
    x = x ^ (x * 0x05526C56)
    return x ^ (x * 0x53A22864)


def pascal(x: UInt) -> UInt:
    """The second Sobol dimension before bit reversal: x times the Pascal matrix mod 2.

    That matrix is the fifth Kronecker power of [[1, 1], [0, 1]], so five masked shifts apply it to 32 bits
    (Ahmed2024) where the usual direction numbers need up to 32 steps.
    """
    x = x ^ ((x & 0xAAAAAAAA) >> 1)
    x = x ^ ((x & 0xCCCCCCCC) >> 2)
    x = x ^ ((x & 0xF0F0F0F0) >> 4)
    x = x ^ ((x & 0xFF00FF00) >> 8)
    return x ^ (x >> 16)


def unit(x: UInt) -> Float:
    """A 32-bit word as a float in [0, 1): its upper 24 bits, which a float32 holds exactly, so 1 is never reached."""
    return dr.float32_array_t(x)(x >> 8) * 2.0**-24


def sobol_pair(key: UInt, index: UInt, dimension: UInt) -> Pair:
    """Point `index` of an Owen-scrambled Sobol sequence, shuffled for this key and dimension (Burley2020, sec. 3)."""
    seed = mix(key, type(key)(dimension))
    shuffled = dr.brev(owen_hash(dr.brev(type(key)(index)), seed))
    x = owen_hash(shuffled, mix(seed, type(key)(0x51633E2D)))
    y = owen_hash(pascal(shuffled), mix(seed, type(key)(0x68BC21EB)))
    return unit(dr.brev(x)), unit(dr.brev(y))


def independent_pair(key: UInt, index: UInt, dimension: UInt) -> Pair:
    """Two independent numbers: two hashes of a counter, of the same quality as a stateful generator."""
    word = mix(mix(key, type(key)(dimension)), type(key)(index))
    return unit(mix(word, type(key)(0x51633E2D))), unit(mix(word, type(key)(0x68BC21EB)))


# Slope y / x of the lattice: the first 32-bit word for which the shortest dual vector of the lattices of 2, 4, ... 2^20
# points is at least 0.66 times that of a hexagonal lattice (found bit by bit, keeping the 400 best candidates). The
# ratio is 0.74 for 16 points and 0.89 for 64.
SLOPE = 1030637


def lattice_pair(key: UInt, index: UInt, dimension: UInt) -> Pair:
    """Point `index` of a rank-1 lattice, extensible in base 2 (Hickernell2000), randomly shifted and shuffled.

    Every aligned block of 2^m indices is a lattice of 2^m points, translated.
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

#: The samplers of `sampler="default"`: for positions (on a pixel, on a lamp), and for directions.
DEFAULT = ("sobol", "lattice")
