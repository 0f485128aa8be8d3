"""Cornell's text format for gonioreflectometer measurements, as shipped with pbrt-v2."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ...errors import InputError
from .. import colours
from ..tables.base import Measurement
from ..tables.samples import Samples, sampled
from .base import Format
from .text import lines, numbers, written

HEADINGS = ("written by Gonio", "num wls", "wls", "theta i")  # comments that do not describe the material
WAVELENGTHS = np.arange(400.0, 701.0, 10.0)  # wavelengths of the Cornell paints, nm; colors are written at these


class Cornell(Format):
    """Cornell text: the number of wavelengths, the wavelengths in nm, then one sample per row.

    A sample consists of theta_i, phi_i, theta_r, phi_r in radians, and one value per wavelength. Lines that start with
    # are comments, and the first comment is the title.
    """

    name: ClassVar[str] = "cornell"
    suffixes: ClassVar[tuple[str, ...]] = (".brdf",)
    writes: ClassVar[str] = "samples"

    def read(self, data: bytes, where: str, item: str = "") -> Samples:
        comments, words = [], []
        for number, line in enumerate(lines(data, where), 1):
            if line.lstrip().startswith("#"):
                comments.append(line.strip("# \t"))
            else:
                words += [(number, word) for word in line.split()]
        if not words:
            raise InputError("no numbers in this file", where)
        count = numbers([words[0][1]], where, words[0][0])[0]
        if count != int(count) or not 1 <= count <= len(words):
            raise InputError(f"{count:g} wavelengths, in a file of {len(words)} numbers", f"{where}:{words[0][0]}")
        channels = int(count)
        width = 4 + channels
        rest = len(words) - 1 - channels
        if rest <= 0 or rest % width:
            what = f"{max(rest, 0)} numbers follow {channels} wavelengths, a multiple of {width} expected"
            raise InputError(what, where, "the file is truncated, or its count of wavelengths is wrong")
        try:
            values = np.array([word for _, word in words[1:]], np.float64)
        except ValueError:
            values = np.full(1, np.nan)
        if not np.all(np.isfinite(values)):
            for number, word in words:
                numbers([word], where, number)
        nm = values[:channels]
        if np.any(np.diff(nm) <= 0.0) or nm[0] <= 0.0:
            raise InputError("the wavelengths do not increase", where)
        rows = values[channels:].reshape(-1, width)
        about = {"format": self.name, "comments": "\n".join(filter(None, comments))[:2000]}
        title = " ".join([one for one in comments[:3] if one and not one.startswith(HEADINGS)][-2:])
        return Samples(rows[:, :4], rows[:, 4:], where, title, about, nm)

    def write(self, table: Measurement) -> bytes:
        assert isinstance(table, Samples), "ensured by `resampled`"
        nm, values = table.wavelengths, table.values
        if nm is None:  # for one or three channels, write the smoothest spectra of these colors
            nm = WAVELENGTHS
            values = np.repeat(values, 3, 1) if values.shape[1] == 1 else values
            values = values @ colours.to_spectrum(nm)
        title = table.title.replace("\n", " ")
        head = f"# written by Gonio\n# {title}\n# num wls\n{len(nm)}\n\n# wls\n{' '.join(f'{x:.17g}' for x in nm)}\n\n"
        head += "# theta i, phi i, theta s, phi_s, spectral sample values\n\n"
        return (head + written(np.concatenate([table.directions, values], axis=1))).encode()

    def resampled(self, source: Measurement) -> Measurement:
        """Return samples unchanged; evaluate other tables at the directions of `samples.plan`."""
        if isinstance(source, Samples):
            return source
        return sampled(source.rgb, title=source.title, source=source.source)
