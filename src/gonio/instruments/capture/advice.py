"""Warnings about photographs and fits: defects, and parameters that the pictures do not determine."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...fitting.fit import NORMAL_95
from ...measure.angles import half_difference_arrays
from . import pixels
from .fitting import Fitted
from .pixels import Chosen, Scene

NARROW = 5.0  # degrees; a smaller range of difference angles does not determine the Fresnel term
HIGHLIGHT = 4.0  # degrees; the peak of a highlight lies within this angle of the half vector from the normal
CLIPPED = 0.02  # fraction of saturated pixels among the lit pixels above which a warning is issued
VAGUE = 0.25  # relative half width of a confidence interval above which a parameter is reported as uncertain
SMALL = 2.0  # smallest width of a lobe that is resolved, pixels
FAR = 3.0  # number of standard deviations above which a calibration error exceeds its stated uncertainty
ALIKE = 4.0  # number of pixels that count as one above which noise alone does not explain the residuals
WRONG = 0.05  # relative difference between model and pictures above which it is reported


def on(scene: Scene, chosen: Chosen, result: Fitted | None) -> tuple[str, ...]:
    """Warning messages, most severe first; `result` is None if no material was fitted."""
    return (*_on_pictures(scene, chosen), *(_on_fit(scene, result) if result is not None else ()))


def _on_pictures(scene: Scene, chosen: Chosen) -> Iterator[str]:
    half, difference = [], []
    for part in chosen.parts:
        wo, wi, _ = pixels.directions(scene, part.kind, part.place, part.lamp)
        theta_h, theta_d, _ = half_difference_arrays(wo, wi)
        half.append(theta_h)
        difference.append(theta_d)
    nearest = float(np.degrees(np.percentile(np.concatenate(half), 0.1)))
    low, high = np.degrees(np.percentile(np.concatenate(difference), [1.0, 99.0]))
    span = f"difference angles of {low:.0f} to {high:.0f} degrees"
    if len(scene.names) == 1:
        yield (
            f"only one light, with {span}: one highlight determines the roughness only if the model is right, and the "
            "index of refraction and the Fresnel term remain undetermined"
        )
    elif high - low < NARROW:
        yield f"{span} only: they do not determine the index of refraction and the Fresnel term"
    clipped, used = chosen.counts["saturated"], chosen.counts["used"]
    if nearest > HIGHLIGHT:
        why = ", which is saturated" if clipped else ""
        yield f"no pixel within {nearest:.0f} degrees of the peak of a highlight{why}: the roughness is uncertain"
    if clipped > CLIPPED * (clipped + used):
        yield f"{100.0 * clipped / (clipped + used):.0f} % of the lit pixels are saturated: add a shorter exposure"


def _on_fit(scene: Scene, result: Fitted) -> Iterator[str]:
    fit = result.fit
    for name, value, error in zip(fit.names, fit.values, fit.errors, strict=True):
        if np.isfinite(error) and NORMAL_95 * error > VAGUE * max(abs(value), 1e-3):
            yield f"the pictures do not determine {name} well: {value:.3g} +- {NORMAL_95 * error:.2g}"
    yield from fit.notes
    if scene.ball is not None:
        pixel = scene.ball.pixel / scene.ball.radius
        for name, value in zip(fit.names, fit.values, strict=True):
            if name.rpartition(".")[2] == "alpha" and value < SMALL * pixel:
                yield f"{name} = {value:.3g} gives a highlight of {value / pixel:.1f} pixels: move the camera closer"
    for name, (value, _) in result.faults.items():
        if abs(value) > FAR:
            yield f"{name} is {abs(value):.1f} standard deviations from the value in the calibration"
    if result.problem.alike > ALIKE:
        yield "errors of neighboring pixels are correlated: the calibration or the model is wrong"
    if fit.relative > max(WRONG, 3.0 * result.noise):
        yield f"the model differs from the pictures by {100.0 * fit.relative:.0f} %: its intervals are unreliable"
