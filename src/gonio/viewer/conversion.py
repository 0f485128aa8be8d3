"""`gonio convert` and `go.convert`: conversion of a picture, measured values or a material to another format."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from pathlib import Path

from ..catalog import documents, notation, operands
from ..catalog.material import material as as_material
from ..catalog.operands import Kind
from ..errors import GonioWarning, InputError
from ..measure import compare
from ..owner import public
from ..pictures import exposures, images


@dataclass(frozen=True)
class Conversion:
    """A file that has been written in another format.

    output   the file
    summary  a one-line description
    notices  properties that the format cannot represent, values that were clipped, and values that were not measured
    facts    for pictures, `exposure` (stops, or None); for tables, `kind`, `resampled`, `error`, `size` (bytes), the
             components of the error, `resolution` and `reciprocity`, and `measured`, the measured angles, if the file
             also contains values at other angles
    """

    output: Path
    summary: str
    notices: tuple[str, ...] = ()
    facts: dict[str, object] = field(default_factory=dict)

    def as_dict(self) -> dict[str, object]:
        """Dictionary for JSON."""
        return {"output": str(self.output), **self.facts}

    def __str__(self) -> str:
        return self.summary


@public
def convert(
    source: str | Path, output: str | Path, *, exposure: exposures.Exposure = 0.0, phi: int | None = None
) -> Conversion:
    """Convert a picture, measured values, or another program's material to the format given by the output's suffix.

        go.convert("ball.exr", "ball.png", exposure="auto")
        go.convert("gold.binary", "gold.bsdf").facts["error"]

    source    a picture, a file of measured values, a file that describes a material (.gltf, .mtlx, .json), or a
              material, such as "openpbr(base_metalness=1)" or "FILE.py:CLASS"
    output    the file to write
    exposure  exposure of a .png, in stops, or "auto"
    phi       range of phi_d in a .binary, in degrees and in cells of one degree: 180, or 360, which preserves
              nonreciprocal values; by default, the range of the table if it has such cells, otherwise 180
    Warns (GonioWarning) about properties that the format cannot represent, and about values that were not measured.
    Raises InputError for formats that cannot be read or written.
    """
    result = converted(str(source), Path(output), exposure, phi)
    for notice in result.notices:
        warnings.warn(notice, GonioWarning, stacklevel=4)  # past the checks and the lock
    return result


def converted(
    source: str,
    output: Path,
    exposure: exposures.Exposure = 0.0,
    phi: int | None = None,
    location: str = "source",
) -> Conversion:
    """As `convert`, but without warnings. Errors about the source are reported at `location`."""
    kind = operands.kind_of(source, {Kind.PICTURE, Kind.NAME, Kind.CODE, Kind.TABLE, Kind.DOCUMENT}, location)
    if phi is not None and kind is not Kind.TABLE:
        raise InputError(f"{phi} given for {source}, which is not a table of measured values", "phi", "omit it")
    if kind is Kind.DOCUMENT:
        notices = documents.convert(source, output)
        return Conversion(output, str(output), notices, {"notices": notices})
    if kind in (Kind.NAME, Kind.CODE):
        documents.write(notation.as_json(as_material(source)), output)
        return Conversion(output, str(output))
    if kind is Kind.TABLE:
        table = compare.convert(source, output, phi)
        return Conversion(output, _table_summary(table), _repeated(table), table.as_dict())
    shown = images.convert(Path(source), output, exposure)
    summary = str(output) if shown.exposure is None else f"{output}  exposure {shown.exposure:+g} EV"
    facts: dict[str, object] = {"exposure": shown.exposure, "notice": shown.notice}
    return Conversion(output, summary, (shown.notice,) if shown.notice else (), facts)


def _repeated(table: compare.Converted) -> tuple[str, ...]:
    """A notice if the file contains values at angles at which the source has none."""
    if not table.measured:
        return ()
    made = f"the other values of {table.path.name} are interpolated or repeated, which the file does not state"
    return (f"measured {table.measured}; {made}",)


def _table_summary(table: compare.Converted) -> str:
    """A summary of the file that was written, with its error and the causes of the error."""
    how = "resampled" if table.resampled else "the same values"
    text = f"{table.path}  {table.size / 1e6:.2f} MB, {table.kind}, {how}: {100.0 * table.error:.2g} % off on average"
    if table.reciprocity:
        asymmetry, coarse = 100.0 * table.reciprocity, 100.0 * table.resolution
        hint = "; --phi 360 preserves it" if table.path.suffix.lower() == ".binary" else ""
        text += f"\n  of which {coarse:.2g} % by resolution, {asymmetry:.2g} % by the asymmetry of the table{hint}"
    return text
