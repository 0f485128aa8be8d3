"""Albedos of a material as shader code without tables: `gonio emit MATERIAL --fit ORDER`."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence

from ..energy.tables import curves as fits
from ..energy.tables.curves import Curve, Rational
from ..material import BSDF
from ..ops import Scalar, function, maximum, vec2, vec3
from .bundle import Bundle
from .functions import functions_bundle
from .placement import Placement


def fitted(model: BSDF, order: str, lang: str, placement: Placement | None = None) -> tuple[Bundle, list[str]]:
    """The albedo curves of a material as code, and one line per curve with its errors.

    order  order of the rational fits, "N" or "N/M"
    """
    fits.degrees(order)  # raises before anything is computed
    curves = fits.fit(fits.sample(model), order)
    return curves_bundle(curves, repr(model), order, lang, placement), errors(curves)


def curves_bundle(
    curves: Sequence[Curve], title: str, order: str, lang: str, placement: Placement | None = None
) -> Bundle:
    """Functions `albedo(roughness, cos_theta)`, `average_albedo(roughness)` and, if available, `dfg`.

    The manifest has the additional key `errors`: the largest and the mean error of each function.
    """
    made = [(written(curve), _types(curve)) for curve in curves if curve.swept or curve.angle]
    low = f"roughness from {fits.LEAST_ROUGHNESS:g} and cosines from {fits.LEAST_COSINE:g}; constant below."
    text = "\n".join([*textwrap.wrap(title, 105), f"Fits of order {order}, for {low}", *errors(curves)])
    bundle = functions_bundle(made, lang, text, placement)
    bundle.manifest["errors"] = {curve.name: {"max": curve.error, "mean": curve.mean} for curve in curves}
    return bundle


def errors(curves: Sequence[Curve]) -> list[str]:
    """One line per curve: its largest and its mean error, or its value if it is constant."""
    lines = []
    for curve in curves:
        if curve.swept or curve.angle:
            lines.append(f"{curve.name}: largest error {curve.error:.1e}, mean {curve.mean:.1e}")
        else:
            lines.append(f"{curve.name} = " + ", ".join(f"{part.above[0, 0]:.7g}" for part in curve.parts))
    return lines


def _types(curve: Curve) -> dict[str, str | None]:
    return {"roughness": "float" if curve.swept else None, "cos_theta": "float" if curve.angle else None}


def written(curve: Curve) -> Callable:
    """A curve as a function of a roughness and a cosine, or of one of them, written with the operations of
    `gonio.ops`."""

    def part(fitted: Rational, roughness: Scalar, cos_theta: Scalar) -> Scalar:
        return fitted(*fits.variables(fitted.forms, roughness, cos_theta))

    def value(roughness: Scalar | None, cos_theta: Scalar | None) -> object:
        rough = 0.0 if roughness is None else maximum(roughness, fits.LEAST_ROUGHNESS)
        cosine = 1.0 if cos_theta is None else maximum(cos_theta, fits.LEAST_COSINE)
        parts = [part(fitted, rough, cosine) for fitted in curve.parts]  # type: ignore[arg-type]
        if curve.name == "dfg":
            return vec2(parts[0] - parts[0] * parts[1], parts[0] * parts[1])
        return parts[0] if len(parts) == 1 else vec3(*parts)

    value.__name__, value.__doc__ = curve.name, curve.doc
    return function(value)
