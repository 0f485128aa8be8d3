"""Refractive indices by name, each with its source.

Metals: n and k at 650, 550 and 450 nm, standing for red, green and blue. Three wavelengths are not a spectrum: the
colour is close to, not equal to, that of the full spectrum under daylight. Those of silver, gold and copper are the fit
of Brendel and Bormann's model in Rakic1998.
"""

from __future__ import annotations

from typing import NamedTuple

RGB_WAVELENGTHS = (650.0, 550.0, 450.0)  # nm


class Metal(NamedTuple):
    """Complex index n + i k at `RGB_WAVELENGTHS`."""

    name: str
    eta: tuple[float, float, float]
    k: tuple[float, float, float]
    source: str


class Medium(NamedTuple):
    """Real index of a transparent medium near 589 nm."""

    name: str
    eta: float
    source: str


_PALIK = "Palik1998"
METALS = {
    "Ag": Metal("silver", (0.15943, 0.14512, 0.13547), (3.9291, 3.1900, 2.3808), "Rakic1998"),
    "Al": Metal("aluminium", (1.6574, 0.88037, 0.52123), (9.2239, 6.2695, 4.8370), "McPeak2015"),
    "Au": Metal("gold", (0.18299, 0.42108, 1.3734), (3.4242, 2.3459, 1.7704), "Rakic1998"),
    "Cr": Metal("chromium", (3.1071, 3.1812, 2.3230), (3.3314, 3.3291, 3.1350), "Johnson1974"),
    "Cu": Metal("copper", (0.27105, 0.67693, 1.3164), (3.6092, 2.6248, 2.2921), "Rakic1998"),
    "Fe": Metal("iron", (2.9114, 2.9497, 2.5845), (3.0893, 2.9318, 2.7670), "Johnson1974"),
    "Hg": Metal("mercury", (2.0733, 1.5523, 1.0606), (5.3383, 4.6510, 3.8628), "Inagaki1981"),
    "Ni": Metal("nickel", (2.0140, 1.7724, 1.6288), (3.8079, 3.2526, 2.6540), _PALIK),
    "Ti": Metal("titanium", (2.7407, 2.5418, 2.2370), (3.8143, 3.4345, 3.0235), "Johnson1974"),
    "W": Metal("tungsten", (3.6925, 3.5000, 3.3090), (2.9370, 2.7291, 2.5258), _PALIK),
}

MEDIA = {
    "vacuum": Medium("vacuum", 1.0, "by definition"),
    "air": Medium("air", 1.00029, "course notes, part B"),
    "water": Medium("water, 20 C", 1.333, "course notes, part B"),
    "ice": Medium("ice", 1.31, "Hecht2017"),
    "glass": Medium("crown glass", 1.5, "course notes, part B"),
    "bk7": Medium("borosilicate glass BK7", 1.5168, "SchottBK7"),
    "sapphire": Medium("sapphire", 1.77, "Hecht2017"),
    "diamond": Medium("diamond", 2.42, "course notes, part B"),
}
