"""A measured material: a BSDF that reads a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ... import ops
from ...material import BSDF, KnownViolation, Sample, file, method
from ...material.angular_range import AngularRange
from ...measure import SAMPLE, names_table, read
from ...measure.tables.base import Measurement, above
from ...ops import Direction, Mode, Scalar, Spectrum, where


class Measured(BSDF):
    """A table of measured values, interpolated in its own coordinates (course notes, part B).

    The supported formats are MERL's .binary, the RGL's .bsdf, Cornell's .brdf, ASTM E1392 (.astm), Zemax (.zbsdf),
    neural networks (.npz, as FILE.npz:NAME) and Gonio's .gonio; docs/measured.md describes each format. The data are
    not corrected: negative values remain negative, an albedo above 1 remains above 1, and a table that is not
    reciprocal remains so. The material only reflects and is black from below. Directions are sampled from the densities
    in the file (RGL) or from a density computed from the table.
    """

    file: str = file(
        default=SAMPLE,
        doc="file of measured values; `FILE:ITEM` selects one of its tables; `sample` is a table included with Gonio",
    )
    only_rgb: ClassVar[bool] = True
    known_violations: ClassVar[Mapping[str, KnownViolation]] = {
        "energy": KnownViolation(
            "the measured albedo exceeds 1 and is not corrected",
            lambda model: max(1.05 * float(model.table.albedos().max()) - 1.0, 0.0),
            certain=False,
        ),
        "reciprocity": KnownViolation(
            "measured values that are not reciprocal are not corrected",
            lambda model: 0.0 if model.table.reciprocal else 2.0,
            certain=False,
        ),
        "positivity": KnownViolation(
            "negative measured values, given relative to the largest value, are not corrected",
            lambda model: 1.0 if model.table.flaws.get("negative") else 0.0,
            certain=False,
        ),
        "isotropy": KnownViolation(
            "the table is not mirror-symmetric, or sums in its lookup lose digits at the edge of a lobe",
            lambda model: 0.0 if model.table.mirrored else 2.0,
            certain=False,
        ),
        "precision": KnownViolation(
            "sums in the table lookup lose digits at the edge of a lobe",
            lambda model: 0.1 if model.table.sums else 0.0,
            certain=False,
        ),
    }

    def __post_init__(self) -> None:
        super().__post_init__()
        table = read(self.file)
        table.prepare()
        vars(self)["_table"] = table

    @classmethod
    def reads(cls, text: str) -> bool:
        return text == SAMPLE or names_table(text)

    @property
    def table(self) -> Measurement:
        """The table read from `file`."""
        table: Measurement = vars(self)["_table"]
        return table

    @property
    def angular_range(self) -> AngularRange:
        return self.table.angular_range

    @property
    def isotropic(self) -> bool:
        return self.table.isotropic

    @method
    def eval(self, wo: Direction, wi: Direction, mode: Mode = "radiance") -> Spectrum:
        """f cos theta_i, read from the table."""
        return where(above(wo, wi), self.table.value(wo, wi), 0.0)

    @method
    def pdf(self, wo: Direction, wi: Direction) -> Scalar:
        """The table's density, or that of the guide computed for it."""
        return where(above(wo, wi), self.table.pdf(wo, wi), 0.0)

    @method
    def sample(self, wo: Direction, u: Direction, mode: Mode = "radiance") -> Sample:
        """A direction with the density `pdf`."""
        wi, pdf = self.table.draw(wo, u)
        pdf = where(above(wo, wi), pdf, 0.0)
        value = self.table.value(wo, wi)
        weight = where(pdf > 0.0, value * ops.safe_div(1.0, pdf), 0.0)
        return Sample.of_density(wi, weight, pdf)
